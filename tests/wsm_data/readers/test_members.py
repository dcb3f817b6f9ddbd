import pytest

from wsm_data.readers.containers import find_containers
from wsm_data.readers.members import iter_members


def members_of(source, dataset, wanted=lambda name: True):
    (container,) = find_containers(source, dataset)
    return {member.name: bytes(member.data) for member in iter_members(source, container, wanted)}


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
