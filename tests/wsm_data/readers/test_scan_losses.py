"""What is not there, not whole or not readable is refused by name; nothing is lost without a line."""

import errno
import os
from pathlib import Path

import pytest

from wsm_data.errors import DataError, Reason


def only_refusal(scan, reason: Reason, unit: str = "gibson_d435i/Acker.ville/000000"):
    """The one refusal of a scan; every other episode went on."""
    (refusal,) = scan.refusals
    assert (refusal.reason, refusal.unit) == (reason, unit)
    return refusal


def break_link(path):
    path.unlink(missing_ok=True)
    path.symlink_to(path.parent / "gone")


def refused(scan_all):
    with pytest.raises(DataError) as caught:
        scan_all()
    return caught.value


@pytest.mark.parametrize("kind", ["rgb", "depth", "table"])
def test_a_link_that_leads_nowhere_refuses_its_episode_alone(build, tmp_path, scan_all, kind):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0), 1: build.episode(1)}))
    name = {
        "rgb": f"{build.rgb_folder}/episode_000000_003.jpg",
        "depth": f"{build.depth_folder}/episode_000000_003.png",
        "table": "data/chunk-000/episode_000000.parquet",
    }[kind]
    break_link(tmp_path / build.group / build.scene / name)
    (scan,) = scan_all().values()
    assert name in only_refusal(scan, Reason.FILE_UNREADABLE).message
    assert [record.id.episode for record in scan.records] == ["000001"]


@pytest.mark.parametrize("number", [errno.EACCES, errno.EIO])
def test_an_image_that_cannot_be_read_refuses_its_episode_alone(build, tmp_path, scan_all, monkeypatch, number):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0), 1: build.episode(1)}))
    fail_to_read(monkeypatch, "episode_000000_003.jpg", number)
    (scan,) = scan_all().values()
    refusal = only_refusal(scan, Reason.FILE_UNREADABLE)
    assert refusal.details["error"] == errno.errorcode[number]
    assert "episode_000000_003.jpg" in refusal.message


def test_a_full_disk_is_no_refusal(build, tmp_path, scan_all, monkeypatch):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    fail_to_read(monkeypatch, "episode_000000_003.jpg", errno.ENOSPC)
    with pytest.raises(OSError, match="No space"):
        scan_all()


def fail_to_read(monkeypatch, name, number):
    read_bytes = Path.read_bytes

    def failing(path):
        if path.name == name:
            raise OSError(number, os.strerror(number), str(path))
        return read_bytes(path)

    monkeypatch.setattr(Path, "read_bytes", failing)


@pytest.mark.parametrize(
    "link", ["scene", "scene.tar.gz", "scene/trajectory_01", "scene/data", "scene/videos/chunk-000"]
)
def test_a_container_behind_a_link_that_leads_nowhere_is_refused(build, tmp_path, scan_all, link):
    path = tmp_path / build.group / link
    path.parent.mkdir(parents=True)
    break_link(path)
    assert refused(scan_all).reason is Reason.FILE_UNREADABLE


def test_a_cloud_behind_a_link_that_leads_nowhere_is_not_replaced_by_depth(build, tmp_path, scan_all):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    break_link(tmp_path / build.group / build.scene / "meta/pointcloud.ply")
    (scan,) = scan_all().values()
    assert (len(scan.records), scan.cloud_refusal.reason) == (1, Reason.FILE_UNREADABLE)
    assert scan.depth_samples == {}


def test_a_link_that_leads_nowhere_does_not_matter_where_nothing_is_read(build, tmp_path, scan_all):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    break_link(tmp_path / build.group / build.scene / "meta/info.json")
    (scan,) = scan_all().values()
    assert len(scan.records) == 1


def test_an_unfinished_download_is_refused_even_when_it_looks_whole(build, tmp_path, scan_all):
    path = build.write_archive(tmp_path, build.scene_files({0: build.episode(0)}))
    path.rename(path.with_name(f"{path.name}.part"))
    error = refused(scan_all)
    assert error.reason is Reason.ARCHIVE_TRUNCATED
    assert "not finished" in error.message


def test_an_episode_that_is_only_named_is_refused_and_not_forgotten(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    scan = scan_scene({name: data for name, data in files.items() if "episode_000000" not in name})
    only_refusal(scan, Reason.EPISODE_MISSING)
    assert [record.id.episode for record in scan.records] == ["000001"]


def test_the_list_of_a_scene_above_its_trajectory_folders_makes_no_episodes(build, tmp_path, scan_all):
    files = {f"trajectory_07/{name}": data for name, data in build.trajectory_files(build.episode(0)).items()}
    files["meta/episodes.jsonl"] = b'{"episode_index": 0, "length": 7}\n'
    build.write_archive(tmp_path, files)
    (scan,) = scan_all().values()
    assert ([record.id.episode for record in scan.records], scan.refusals) == (["000007"], ())


def test_a_folder_too_high_is_told_what_the_source_must_look_like(build, tmp_path, scan_all):
    build.write_archive(tmp_path / "above", build.scene_files({0: build.episode(0)}))
    error = refused(scan_all)
    assert error.reason is Reason.CONTAINER_NO_EPISODES
    assert "<group>/<scene>.tar.gz" in error.message


BLACK_POINTS = 4


@pytest.mark.parametrize("cloud", ["meta/pointcloud.ply", "data/chunk-000/path.ply"])
@pytest.mark.parametrize("packed", [True, False])
def test_black_points_are_the_path_in_the_clouds_of_trajectories(build, tmp_path, scan_all, cloud, packed):
    files = build.trajectory_files(build.episode(0), cloud=cloud)
    files[cloud] = build.cloud(black=BLACK_POINTS)
    if packed:
        build.write_archive(tmp_path, {f"trajectory_01/{name}": data for name, data in files.items()})
    else:
        build.write_trajectories(tmp_path, {"trajectory_01": files})
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == 50 - BLACK_POINTS
    assert scan.cloud.rgb_u8.any(axis=1).all()


def test_black_points_of_a_scene_are_surface(build, scan_scene):
    files = build.scene_files({0: build.episode(0)})
    files["meta/pointcloud.ply"] = build.cloud(black=BLACK_POINTS)
    assert len(scan_scene(files).cloud.xyz_m) == 50


@pytest.mark.parametrize("own", [True, False])
def test_a_trajectory_without_a_cloud_has_the_one_of_its_scene(build, tmp_path, scan_all, own):
    files = build.trajectory_files(build.episode(0), cloud="meta/pointcloud.ply" if own else "")
    build.write_trajectories(tmp_path, {"trajectory_01": files})
    build.write_scene_folder(tmp_path, {"meta/pointcloud.ply": build.cloud(points=60, black=BLACK_POINTS)})
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == (50 if own else 60)  # a scene's black points are surface
    assert scan.depth_samples == {}


def test_a_damaged_cloud_of_the_scene_is_not_replaced_by_depth(build, tmp_path, scan_all):
    build.write_trajectories(tmp_path, {"trajectory_01": build.trajectory_files(build.episode(0), cloud="")})
    build.write_scene_folder(tmp_path, {"meta/pointcloud.ply": b""})
    (scan,) = scan_all().values()
    assert scan.cloud_refusal.reason is Reason.CLOUD_UNREADABLE
    assert scan.depth_samples == {}
