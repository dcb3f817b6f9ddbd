"""A local folder and an object store give the same answers to the same questions."""

import fsspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.stores import LocalStore, open_store

FILES = {"b.tar": bytes(range(256)) * 5, "a.json": b"{}", "empty": b""}


def local_folder(tmp_path):
    for name, data in {**FILES, "sub/c.tar": b"below"}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    return str(tmp_path)


def memory_folder():
    filesystem = fsspec.filesystem("memory")
    for name, data in {**FILES, "sub/c.tar": b"below"}.items():
        filesystem.pipe_file(f"/stores-test/{name}", data)
    return "memory://stores-test"


@pytest.fixture(params=["local", "file", "memory", "memory with a slash at the end"])
def store(request, tmp_path):
    if request.param == "local":
        yield open_store(local_folder(tmp_path))
    elif request.param == "file":
        yield open_store("file://" + local_folder(tmp_path))
    else:
        yield open_store(memory_folder() + ("/" if "slash" in request.param else ""))
        fsspec.filesystem("memory").rm("/stores-test", recursive=True)


def test_names_are_the_files_directly_below_in_order(store):
    assert store.names() == ["a.json", "b.tar", "empty"]


def test_a_file_is_read_whole(store):
    assert {name: store.read(name) for name in store.names()} == FILES


def test_sizes_are_those_of_the_files(store):
    assert [store.size_bytes(name) for name in store.names()] == [2, 1280, 0]


def test_only_files_exist(store):
    assert [store.exists(name) for name in ("a.json", "sub/c.tar", "sub", "absent")] == [True, True, False, False]


@pytest.mark.parametrize(("offset", "size"), [(0, 10), (100, 1), (1270, 10), (0, 1280), (500, 0)])
def test_a_range_is_that_part_of_the_file(store, offset, size):
    assert store.read_range("b.tar", offset, size) == FILES["b.tar"][offset : offset + size]


@pytest.mark.parametrize(("offset", "size"), [(1270, 100), (1280, 10), (5000, 10)])
def test_a_range_past_the_end_is_cut_there(store, offset, size):
    assert store.read_range("b.tar", offset, size) == FILES["b.tar"][offset : offset + size]


def test_a_file_in_a_folder_below_is_reached_by_its_path(store):
    assert store.read("sub/c.tar") == b"below"


@pytest.mark.parametrize("question", ["size_bytes", "read"])
def test_a_missing_file_is_not_found(store, question):
    with pytest.raises(FileNotFoundError):
        getattr(store, question)("absent")


def test_a_range_of_a_missing_file_is_not_found(store):
    with pytest.raises(FileNotFoundError):
        store.read_range("absent", 0, 1)


@pytest.mark.parametrize("location", ["{tmp}/absent", "file://{tmp}/absent", "memory://absent"])
def test_a_missing_folder_has_no_listing_and_no_files(tmp_path, location):
    store = open_store(location.format(tmp=tmp_path))
    assert not store.exists("a.json")
    with pytest.raises(FileNotFoundError):
        store.names()


def test_the_kind_of_store_follows_from_the_location(tmp_path):
    assert isinstance(open_store(tmp_path), LocalStore)
    assert isinstance(open_store(str(tmp_path)), LocalStore)
    assert isinstance(open_store("memory://release"), FsspecStore)
    assert isinstance(open_store(f"file://{tmp_path}"), FsspecStore)


def test_a_store_remembers_where_it_is(tmp_path):
    assert open_store(tmp_path).root == str(tmp_path)
    assert open_store("memory://release").root == "memory://release"


def test_the_root_of_an_object_store_is_a_folder_too():
    filesystem = fsspec.filesystem("memory")
    filesystem.pipe_file("/stores-test-at-root.json", b"{}")
    try:
        assert open_store("memory://").read("stores-test-at-root.json") == b"{}"
    finally:
        filesystem.rm("/stores-test-at-root.json")


@given(offset=st.integers(0, 1500), size=st.integers(0, 1500))
def test_local_and_remote_ranges_agree_everywhere(tmp_path_factory, offset, size):
    folder = tmp_path_factory.getbasetemp() / "range-agreement"
    folder.mkdir(exist_ok=True)
    (folder / "b.tar").write_bytes(FILES["b.tar"])
    fsspec.filesystem("memory").pipe_file("/range-agreement/b.tar", FILES["b.tar"])
    local, remote = open_store(folder), open_store("memory://range-agreement")
    assert local.read_range("b.tar", offset, size) == remote.read_range("b.tar", offset, size)
