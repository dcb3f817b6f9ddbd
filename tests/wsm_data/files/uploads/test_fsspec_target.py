"""A store that says nothing of its bytes is believed when they were read back."""

import fsspec
import pytest

from wsm_data.errors import StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.files.uploads.local_file import look_at


@pytest.fixture(params=["memory://uploads-{name}", "file://{tmp}/there"])
def target(request, tmp_path):
    url = request.param.format(name=tmp_path.name, tmp=tmp_path)
    return FsspecTarget(FsspecStore(url))


@pytest.fixture
def file(tmp_path):
    (tmp_path / "a").write_bytes(b"some bytes")
    return look_at(tmp_path / "a", 1 << 20)


def test_what_was_put_is_held_below_any_folder(target, file):
    assert not target.holds("sub/a", file)
    target.put("sub/a", file)
    assert target.holds("sub/a", file)
    assert target.store.read("sub/a") == b"some bytes"


def test_other_bytes_of_the_same_size_are_not_held_and_are_replaced(target, file, tmp_path):
    (tmp_path / "b").write_bytes(b"other byte")
    target.put("a", look_at(tmp_path / "b", 1 << 20))
    assert not target.holds("a", file)
    target.put("a", file)
    assert target.holds("a", file)


def test_what_is_removed_is_gone_and_may_be_removed_again(target, file):
    target.put("a", file)
    target.remove("a")
    target.remove("a")
    assert not target.store.exists("a")


def test_a_store_that_keeps_other_bytes_than_it_was_sent_is_not_believed(file, monkeypatch):
    memory = fsspec.filesystem("memory").__class__
    monkeypatch.setattr(memory, "put_file", lambda self, lpath, rpath: self.pipe_file(rpath, b"some_bytes"))
    with pytest.raises(StoreError, match="holds others"):
        FsspecTarget(FsspecStore("memory://uploads-lying")).put("a", file)


def test_such_a_store_states_no_checksum(target):
    assert target.checksum("a") == ""
