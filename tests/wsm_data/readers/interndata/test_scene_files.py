import errno
import os

import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.interndata.containers import find_containers
from wsm_data.readers.interndata.scene_files import iter_members


def members_of(source, dataset, wanted=lambda name: True):
    (container,) = find_containers(source, dataset)
    return {member.name: bytes(member.data) for member in iter_members(source, container, wanted, 10**9)}


def test_an_archive_and_a_folder_give_the_same_members(build, tmp_path, dataset):
    files = build.scene_files({0: build.episode(0)})
    build.write_archive(tmp_path / "archive", files)
    build.write_scene_folder(tmp_path / "folder", files)
    assert members_of(tmp_path / "archive", dataset) == members_of(tmp_path / "folder", dataset) == files


def test_only_wanted_members_are_read(build, tmp_path, dataset):
    files = build.scene_files({0: build.episode(0)})
    build.write_scene_folder(tmp_path, files)
    assert list(members_of(tmp_path, dataset, lambda name: name.endswith(".parquet"))) == [
        "data/chunk-000/episode_000000.parquet"
    ]


@pytest.mark.parametrize("prefix", ["Acker.ville/", "./Acker.ville/", "another_name/", "", "./"])
def test_the_folder_around_an_archive_does_not_show_in_the_names(build, tmp_path, dataset, prefix):
    files = build.scene_files({0: build.episode(0)})
    path = build.write_archive(tmp_path, files)
    path.write_bytes(build.archive({f"{prefix}{name}": data for name, data in files.items()}))
    assert members_of(tmp_path, dataset) == files


def test_trajectory_folders_in_an_archive_keep_their_names(build, tmp_path, dataset):
    files = {f"trajectory_03/{name}": data for name, data in build.trajectory_files(build.episode(0)).items()}
    build.write_archive(tmp_path, files)
    assert members_of(tmp_path, dataset) == files


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
    plain_open = open

    def failing(path, *args, **options):
        if str(path).endswith(f"/{name}"):
            raise OSError(number, os.strerror(number), str(path))
        return plain_open(path, *args, **options)

    monkeypatch.setattr("builtins.open", failing)


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


@pytest.mark.parametrize("prefix", ["gibson_d435i/Acker.ville/", "a/b/Acker.ville/", "gibson_d435i/renamed/"])
def test_a_scene_that_lies_deeper_in_its_archive_is_read_under_its_own_id(build, tmp_path, scan_all, prefix):
    files = build.scene_files({0: build.episode(0)})
    path = build.write_archive(tmp_path, files)
    path.write_bytes(build.archive({f"{prefix}{name}": data for name, data in files.items()}))
    (scan,) = scan_all().values()
    assert [record.id.text for record in scan.records] == ["gibson_d435i/Acker.ville/000000"]


def test_a_scene_that_seems_to_be_a_trajectory_folder_is_said_to_lie_one_level_deeper(build, tmp_path, scan_all):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    path = build.write_archive(tmp_path, files)
    path.write_bytes(build.archive({f"other/folder/{name}": data for name, data in files.items()}))
    error = refused(scan_all)
    assert error.reason is Reason.CONTAINER_MISPLACED
    assert "one level deeper" in error.message


def test_names_with_backslashes_are_shown(build, tmp_path, scan_all):
    files = build.scene_files({0: build.episode(0)})
    path = build.write_archive(tmp_path, files)
    path.write_bytes(build.archive({f"scene/{name}".replace("/", "\\"): data for name, data in files.items()}))
    assert "backslashes" in refused(scan_all).message
