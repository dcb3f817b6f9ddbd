import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.folder_walk import file_member, walk_folder


def write(root, *names):
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(name.encode())


def walk(root, tops=("a", "b"), wanted=lambda name: True, is_folder=lambda name: False):
    members = walk_folder(root, "scene", tops, wanted, is_folder, 10**6)
    return [(member.name, bytes(member.content())) for member in members]


def test_files_come_sorted_within_each_top_and_others_are_not_looked_at(tmp_path):
    write(tmp_path, "b/2", "b/1", "a/z/1", "a/y", "c/1")
    names = [name for name, _ in walk(tmp_path, tops=("b", "a", "absent"))]
    assert names == ["b/1", "b/2", "a/y", "a/z/1"]


def test_a_file_that_is_not_wanted_is_not_read(tmp_path):
    write(tmp_path, "a/1", "a/2")
    assert walk(tmp_path, wanted=lambda name: name == "a/2") == [("a/2", b"a/2")]


def test_a_linked_folder_is_followed(tmp_path):
    write(tmp_path, "elsewhere/1")
    (tmp_path / "a").symlink_to(tmp_path / "elsewhere")
    assert walk(tmp_path) == [("a/1", b"elsewhere/1")]


def test_two_links_to_the_folder_they_lie_in_are_refused_and_not_walked_forever(tmp_path):
    write(tmp_path, "a/1")
    for name in ("p", "q"):  # followed to the system's depth of 40, these are 2**40 folders
        (tmp_path / "a" / name).symlink_to(tmp_path / "a")
    with pytest.raises(DataError) as caught:
        walk(tmp_path)
    assert caught.value.reason == Reason.FILE_LINK_LOOP
    assert "scene:a/p" in caught.value.message


def test_a_folder_that_cannot_be_reached_is_refused_where_one_must_be(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a/inner").symlink_to(tmp_path / "gone")
    assert walk(tmp_path, wanted=lambda name: False) == []
    with pytest.raises(DataError) as caught:
        walk(tmp_path, wanted=lambda name: False, is_folder=lambda name: name == "a/inner")
    assert caught.value.reason == Reason.FILE_UNREADABLE


def test_a_file_that_cannot_be_read_is_a_member_with_a_refusal(tmp_path):
    member = file_member(str(tmp_path / "gone"), "a/gone", "scene:a/gone", 10**6)
    assert (member.size, member.refusal.reason) == (0, Reason.FILE_UNREADABLE)
