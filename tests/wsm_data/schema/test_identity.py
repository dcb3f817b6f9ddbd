"""What a trajectory is called: text and key tell trajectories apart, and stock webdataset can read the key."""

import io
import os
import re
import tarfile

import pytest
from hypothesis import given
from hypothesis import strategies as st
from webdataset.tariterators import group_by_keys, tar_file_expander

from wsm_data.schema.identity import EpisodeId

NAMES = st.text(min_size=1).filter(lambda name: "/" not in name and name not in (".", ".."))
IDS = st.builds(EpisodeId, NAMES, NAMES, NAMES)


@given(IDS)
def test_the_text_reads_back_as_the_same_id(episode):
    assert EpisodeId.parse(episode.text) == episode


@given(IDS)
def test_a_key_is_three_parts_of_letters_digits_underscores_dashes_and_percent_codes(episode):
    assert re.fullmatch(r"((?:[A-Za-z0-9_-]|%[0-9A-F]{2})+/){2}(?:[A-Za-z0-9_-]|%[0-9A-F]{2})+", episode.key)


@given(IDS, IDS)
def test_distinct_ids_have_distinct_keys(one, other):
    assert (one.key == other.key) == (one == other)


@given(NAMES, NAMES)
def test_names_that_differ_anywhere_have_distinct_keys(one, other):
    assert (EpisodeId("g", one, "e").key == EpisodeId("g", other, "e").key) == (one == other)


@pytest.mark.parametrize(
    ("scene", "encoded"),
    [
        ("17DRP5sb8fy", "17DRP5sb8fy"),
        ("00006-HkseAnWCgqk", "00006-HkseAnWCgqk"),
        ("scene.v2", "scene%2Ev2"),
        ("scene%2Ev2", "scene%252Ev2"),
        ("frl apartment~1", "frl%20apartment%7E1"),
        ("küche", "k%C3%BCche"),
    ],
)
def test_a_scene_name_is_encoded_byte_for_byte(scene, encoded):
    assert EpisodeId("replica_zed", scene, "000001").key == f"replica_zed/{encoded}/000001"


def test_a_folder_name_that_is_not_utf_8_has_a_key_of_its_own():
    undecodable, question_mark = EpisodeId("g", os.fsdecode(b"a\xff"), "e"), EpisodeId("g", "a?", "e")
    assert re.fullmatch(r"g/a(%[0-9A-F]{2})+/e", undecodable.key)
    assert undecodable.key != question_mark.key


def test_undecodable_bytes_are_told_from_the_letter_that_they_would_spell():
    assert EpisodeId("g", "\udcc3\udca9", "e").key != EpisodeId("g", "\u00e9", "e").key


@pytest.mark.parametrize("scene", ["plain", "with.two.dots", "with space", "100%", "küche"])
def test_stock_webdataset_reads_the_key_back(tmp_path, scene):
    key = EpisodeId("gibson_zed", scene, "trajectory_7").key
    with tarfile.open(tmp_path / "a.tar", "w") as archive:
        for member in ("poses.npy", "meta.json"):
            archive.addfile(tarfile.TarInfo(f"{key}.{member}"), io.BytesIO())
    with (tmp_path / "a.tar").open("rb") as file:  # WebDataset(path) is made of these two, but leaves the file open
        (sample,) = group_by_keys(tar_file_expander([{"url": "a.tar", "stream": file}]))
    assert sample["__key__"] == key
    assert {"poses.npy", "meta.json"} < set(sample)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "/"])
@pytest.mark.parametrize("field", ["group", "scene", "episode"])
def test_a_part_that_is_no_name_is_refused(field, name):
    parts = {"group": "g", "scene": "s", "episode": "e", field: name}
    with pytest.raises(ValueError, match=f"^{field} of an episode id must be a name, not a path, found {name!r}"):
        EpisodeId(**parts)


@pytest.mark.parametrize("text", ["", "a", "a/b", "a/b/c/d"])
def test_a_text_without_three_parts_is_refused(text):
    with pytest.raises(ValueError, match=f"has the form group/scene/episode, found {text!r}"):
        EpisodeId.parse(text)


@pytest.mark.parametrize(
    ("group", "camera", "physical_scene"),
    [
        ("gibson_d435i", "d435i", "gibson/Ackermanville"),
        ("gibson_zed", "zed", "gibson/Ackermanville"),
        ("my_home_set_zed", "zed", "my_home_set/Ackermanville"),
        ("replica", "replica", "replica/Ackermanville"),
    ],
)
def test_the_group_ends_in_the_camera_and_the_rest_is_the_scene(group, camera, physical_scene):
    episode = EpisodeId(group, "Ackermanville", "000000")
    assert episode.camera == camera
    assert episode.physical_scene == physical_scene


def test_ids_sort_by_group_then_scene_then_episode():
    ids = [EpisodeId("b", "a", "a"), EpisodeId("a", "b", "2"), EpisodeId("a", "b", "10"), EpisodeId("a", "a", "z")]
    assert [episode.text for episode in sorted(ids)] == ["a/a/z", "a/b/10", "a/b/2", "b/a/a"]
