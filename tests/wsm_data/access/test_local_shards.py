import os
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.access.local_shards import LocalShards, read_scattered
from wsm_data.access.shard_reader import Span
from wsm_data.errors import IntegrityError

SIZE = 5000


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("shards")
    for number in range(12):
        content = np.random.default_rng(number).integers(0, 256, SIZE, np.uint8)
        (path / f"{number}.tar").write_bytes(content.tobytes())
    return path


def _open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@given(
    offset=st.integers(0, SIZE),
    sizes=st.lists(st.integers(0, 700), max_size=8),
)
def test_bytes_land_where_they_belong(folder, offset, sizes):
    content = (folder / "3.tar").read_bytes()
    shards = LocalShards(str(folder))
    buffers = [bytearray(size) for size in sizes]
    if offset + sum(sizes) > SIZE:
        with pytest.raises(IntegrityError, match=f"3.tar .*must reach byte {offset + sum(sizes)}.*ends at byte {SIZE}"):
            shards.read_into("3.tar", offset, [memoryview(buffer) for buffer in buffers])
    else:
        shards.read_into("3.tar", offset, [memoryview(buffer) for buffer in buffers])
        assert b"".join(buffers) == content[offset : offset + sum(sizes)]
    shards.close()


def test_more_buffers_than_the_system_takes_at_once_are_filled(folder):
    buffers = [bytearray(2) for _ in range(2400)]
    LocalShards(str(folder)).read_into("1.tar", 10, [memoryview(buffer) for buffer in buffers])
    assert b"".join(buffers) == (folder / "1.tar").read_bytes()[10:4810]


def test_a_read_that_the_system_cuts_short_goes_on(folder, monkeypatch):
    """A signal, or a limit of the system, may end a read anywhere, also inside a buffer."""
    whole = os.preadv

    def some(descriptor, buffers, offset):
        first = next(buffer for buffer in buffers if buffer.nbytes)
        return whole(descriptor, [first[:7]], offset)

    monkeypatch.setattr(os, "preadv", some)
    buffers = [bytearray(5), bytearray(0), bytearray(40)]
    with (folder / "2.tar").open("rb") as file:
        assert read_scattered(file.fileno(), 3, [memoryview(buffer) for buffer in buffers]) == 45
    assert b"".join(buffers) == (folder / "2.tar").read_bytes()[3:48]


def test_a_missing_shard_is_named(folder):
    with pytest.raises(IntegrityError, match=r"99\.tar is missing from"):
        LocalShards(str(folder)).read_into("99.tar", 0, [memoryview(bytearray(1))])


def test_other_failures_of_the_system_pass_as_they_are(tmp_path):
    (tmp_path / "0.tar").mkdir()
    with pytest.raises(IsADirectoryError):
        LocalShards(str(tmp_path)).read_into("0.tar", 0, [memoryview(bytearray(1))])


def test_no_more_files_are_open_than_allowed_and_none_after_closing(folder):
    before = _open_files()
    shards = LocalShards(str(folder), max_open_files=3)
    for _ in range(3):
        for number in range(12):
            shards.read_into(f"{number}.tar", 0, [memoryview(bytearray(4))])
            assert _open_files() <= before + 3
    shards.close()
    assert _open_files() == before
    shards.close()


def test_the_file_that_was_not_used_for_longest_is_closed_first(folder):
    shards = LocalShards(str(folder), max_open_files=2)
    for name in ("0.tar", "1.tar", "0.tar", "2.tar"):
        shards.read_into(name, 0, [memoryview(bytearray(1))])
    assert list(shards._files) == ["0.tar", "2.tar"]


def test_threads_that_push_out_each_others_files_read_the_right_bytes(folder):
    """With one open file for four threads, files are closed all the time, but never under a thread that reads."""
    shards = LocalShards(str(folder), max_open_files=1)
    contents = [(folder / f"{number}.tar").read_bytes() for number in range(12)]
    wrong: list[int] = []

    def work(seed: int) -> None:
        for number in np.random.default_rng(seed).integers(0, 12, 300).tolist():
            buffer = bytearray(SIZE)
            shards.read_into(f"{number}.tar", 0, [memoryview(buffer)])
            if buffer != contents[number]:
                wrong.append(number)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_a_forgotten_shard_is_opened_anew(folder):
    shards = LocalShards(str(folder))
    shards.read_into("0.tar", 0, [memoryview(bytearray(1))])
    shards.forget("0.tar")
    assert list(shards._files) == []
    shards.expect([Span("0.tar", 0, 1)])
    shards.read_into("0.tar", 0, [memoryview(bytearray(1))])
