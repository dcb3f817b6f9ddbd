import pytest

from wsm_data.errors import ConfigError
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.source import Container
from wsm_data.readers.tum.sequences import find_containers, folder_of


@pytest.fixture(scope="module")
def tum():
    return load_dataset("tum_rgbd")


def sequence(folder):
    folder.mkdir(parents=True)
    (folder / "rgb.txt").write_text("1 a.png\n")
    return folder


def test_a_source_may_be_a_sequence_or_hold_sequences(tmp_path, tum):
    kitchen = sequence(tmp_path / "homes" / "kitchen")
    hall = sequence(tmp_path / "hall")
    assert [one.id for one in find_containers(tmp_path, tum)] == ["hall", "homes/kitchen"]
    (alone,) = find_containers(kitchen, tum)
    assert (alone.id, folder_of(kitchen, alone)) == ("kitchen", kitchen)
    (first, _) = find_containers(tmp_path, tum)
    assert folder_of(tmp_path, first) == hall


def test_a_folder_with_poses_alone_is_listed_so_that_it_is_refused_by_name(tmp_path, tum):
    (tmp_path / "half").mkdir()
    (tmp_path / "half" / "groundtruth.txt").write_text("")
    assert [one.id for one in find_containers(tmp_path, tum)] == ["half"]


@pytest.mark.parametrize("where", ["nowhere", "empty"])
def test_a_source_without_a_sequence_says_what_was_looked_for(tmp_path, tum, where):
    (tmp_path / "empty" / "a" / "b").mkdir(parents=True)
    with pytest.raises(ConfigError, match=r"holds rgb\.txt or groundtruth\.txt"):
        find_containers(tmp_path / where, tum)


def test_a_sequence_deeper_than_three_folders_is_not_looked_for(tmp_path, tum):
    sequence(tmp_path / "1" / "2" / "3" / "4")
    with pytest.raises(ConfigError, match="at most 3 below"):
        find_containers(tmp_path, tum)


def test_a_pattern_of_numbered_images_makes_a_sequence_too(tmp_path):
    (tmp_path / "office0" / "results").mkdir(parents=True)
    (tmp_path / "office0" / "results" / "frame000000.jpg").write_bytes(b"")
    found = find_containers(tmp_path, load_dataset("replica_sequences"))
    assert found == [Container(id="office0", layout="sequence", signature=found[0].signature)]
