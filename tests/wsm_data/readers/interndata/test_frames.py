import errno
import os

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.readers.interndata.containers import find_containers
from wsm_data.readers.interndata.frames import iter_episode_frames
from wsm_data.readers.interndata.scan import scan_container
from wsm_data.schema.source.layout import Layout


@pytest.fixture(params=["archive", "scene_folder"])
def scene(request, build, tmp_path, dataset):
    """Episodes 0 to 2 on disk, and what the first pass said of them."""
    episodes = {n: build.episode(n) for n in range(3)}
    write = build.write_archive if request.param == "archive" else build.write_scene_folder
    write(tmp_path, build.scene_files(episodes))
    (container,) = find_containers(tmp_path, dataset)
    return episodes, container, scan_container(tmp_path, container, dataset, 10).records, write


def test_frames_come_back_as_they_were_stored(scene, tmp_path, dataset):
    episodes, container, records, _ = scene
    found = {record.id.episode: frames for record, frames in iter_episode_frames(tmp_path, container, dataset, records)}
    for number, episode in episodes.items():
        frames = found[f"{number:06d}"]
        assert (frames.rgb, frames.depth) == (tuple(episode.rgb), tuple(episode.depth))


def test_only_the_wanted_episodes_come(scene, tmp_path, dataset):
    _, container, records, _ = scene
    found = list(iter_episode_frames(tmp_path, container, dataset, records[1:2]))
    assert [record.id for record, _ in found] == [records[1].id]
    assert list(iter_episode_frames(tmp_path, container, dataset, ())) == []


def test_frames_of_trajectory_folders_and_of_unprefixed_scenes_come_too(build, tmp_path, dataset):
    episode = build.episode(1, frames=12)
    build.write_trajectories(tmp_path / "t", {"trajectory_01": build.trajectory_files(episode)})
    build.write_archive(tmp_path / "u", build.scene_files({0: build.episode(0), 1: episode}, prefixed=False))
    for source in (tmp_path / "t", tmp_path / "u"):
        (container,) = find_containers(source, dataset)
        records = scan_container(source, container, dataset, 10).records
        *_, (_, frames) = iter_episode_frames(source, container, dataset, records)
        assert frames.rgb == tuple(episode.rgb)


def test_a_folder_is_read_lazily_and_in_the_order_asked_for(build, tmp_path, dataset):
    build.write_scene_folder(tmp_path, build.scene_files({n: build.episode(n) for n in range(3)}))
    (container,) = find_containers(tmp_path, dataset)
    records = scan_container(tmp_path, container, dataset, 10).records
    stream = iter_episode_frames(tmp_path, container, dataset, records[::-1])
    assert next(stream)[0].id.episode == "000002"
    (tmp_path / container.id / records[0].rgb_members[0]).unlink()
    assert next(stream)[0].id.episode == "000001"  # nothing of episode 0 was needed for it
    with pytest.raises(IntegrityError, match="wsm index"):
        next(stream)


@pytest.mark.parametrize("change", ["other bytes", "gone", "cut"])
def test_a_source_that_changed_since_the_first_pass_is_noticed(scene, build, tmp_path, change, dataset):
    episodes, container, records, write = scene
    files = build.scene_files(episodes)
    name = records[1].depth_members[2]
    archive = container.layout == Layout.SCENE_ARCHIVE
    if change == "other bytes":
        files[name] = files[records[1].depth_members[3]]
    else:
        del files[name]
        if not archive:
            (tmp_path / container.id / name).unlink()
    write(tmp_path, files)
    if change == "cut" and archive:
        path = tmp_path / container.id
        path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(IntegrityError, match="wsm index"):
        list(iter_episode_frames(tmp_path, container, dataset, records))


def test_a_container_that_is_gone_is_noticed(build, tmp_path, dataset):
    path = build.write_archive(tmp_path, build.scene_files({0: build.episode(0)}))
    (container,) = find_containers(tmp_path, dataset)
    records = scan_container(tmp_path, container, dataset, 10).records
    path.unlink()
    with pytest.raises(IntegrityError):
        list(iter_episode_frames(tmp_path, container, dataset, records))


def test_a_record_of_another_container_is_a_callers_bug(scene, tmp_path, build, dataset):
    _, _, records, _ = scene
    build.write_trajectories(tmp_path / "other", {"trajectory_01": build.trajectory_files(build.episode(1))})
    (other,) = find_containers(tmp_path / "other", dataset)
    with pytest.raises(ValueError, match="not in"):
        list(iter_episode_frames(tmp_path / "other", other, dataset, records))


@pytest.mark.parametrize("number", [errno.EACCES, errno.EIO])
def test_an_image_that_can_no_longer_be_read_is_named(build, tmp_path, dataset, monkeypatch, number):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    (container,) = find_containers(tmp_path, dataset)
    records = scan_container(tmp_path, container, dataset, 10).records

    def failing(path, *_args, **_options):
        raise OSError(number, os.strerror(number), str(path))

    monkeypatch.setattr("builtins.open", failing)
    with pytest.raises(IntegrityError, match=r"episode_000000_000\.jpg"):
        list(iter_episode_frames(tmp_path, container, dataset, records))
