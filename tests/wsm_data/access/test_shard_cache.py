"""The files of the cache: bounded at every moment, believed only when finished, safe against the death of a process."""

import os
import signal
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.access.shard_cache import ShardCache
from wsm_data.shards.manifest import ShardInfo

DIGEST = "d" * 64
KIB = 1024


def shard(number, size=KIB):
    return ShardInfo(name=f"train-{number:06d}.tar", split="train", clips=0, bytes=size, sha256="")


def put(cache, *shards):
    for one in shards:
        with cache.reserved(one) as file:
            file.write(bytes(one.bytes))


def names(folder):
    return sorted(path.name for path in folder.glob("*/*"))


def bytes_in(folder):
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "cache"


@pytest.fixture
def cache(folder):
    return ShardCache(folder, DIGEST, 3 * KIB)


def test_a_shard_is_believed_when_it_is_finished_and_not_before(cache, folder):
    with cache.reserved(shard(0)) as file:
        file.write(bytes(range(256)) * 4)
        assert not cache.has(shard(0))
    with cache.opened(shard(0)) as file:
        assert file.read() == bytes(range(256)) * 4
    assert ShardCache(folder, DIGEST, 3 * KIB).has(shard(0))  # after a restart too


def test_a_download_that_fails_gives_the_room_back(cache, folder):
    with pytest.raises(ZeroDivisionError), cache.reserved(shard(0)):
        raise ZeroDivisionError
    assert names(folder) == []


def test_room_is_taken_before_the_first_byte_comes(cache, folder):
    put(cache, shard(2))
    with cache.reserved(shard(0, 2 * KIB)):
        assert bytes_in(folder) == 3 * KIB
        with cache.reserved(shard(1, 2 * KIB)) as none:
            assert none is None
        assert cache.has(shard(2))  # nothing is removed for what will not fit anyway


def test_what_is_there_or_underway_is_not_downloaded_again(cache):
    with cache.reserved(shard(0)), cache.reserved(shard(0)) as none:
        assert none is None
    with cache.reserved(shard(0)) as none:
        assert none is None


def test_the_least_recently_used_goes_first_of_whatever_release(cache, folder):
    other = ShardCache(folder, "e" * 64, 3 * KIB)
    put(other, shard(0))
    put(cache, shard(1), shard(2))
    assert other.has(shard(0))  # which is a use
    put(cache, shard(3))
    assert (cache.has(shard(1)), cache.has(shard(2)), cache.has(shard(3))) == (False, True, True)
    assert other.has(shard(0))


def test_a_shard_that_is_removed_may_be_read_to_its_end_by_who_has_it_open(cache):
    put(cache, shard(0))
    with cache.opened(shard(0)) as file:
        cache.remove(shard(0))
        cache.remove(shard(0))
        assert len(file.read()) == KIB
    with cache.opened(shard(0)) as none:
        assert none is None


def test_a_shard_of_another_size_is_not_believed_and_makes_way(cache, folder):
    put(cache, shard(0))
    os.truncate(folder / DIGEST / shard(0).name, 100)
    assert not cache.has(shard(0))
    put(cache, shard(0))
    assert cache.has(shard(0))


def test_files_of_others_are_neither_counted_nor_removed(cache, folder):
    (folder / DIGEST).mkdir()
    for foreign in (folder / "notes.tar", folder / DIGEST / "notes.tar"):
        foreign.write_bytes(bytes(9 * KIB))
    put(cache, shard(0), shard(1), shard(2), shard(3))
    assert names(folder) == ["notes.tar", shard(1).name, shard(2).name, shard(3).name]
    assert (folder / "notes.tar").stat().st_size == 9 * KIB


DIES_IN_A_DOWNLOAD = """
import sys, time
from pathlib import Path
from wsm_data.access.shard_cache import ShardCache
from wsm_data.shards.manifest import ShardInfo
folder, digest, name, size = sys.argv[1:]
shard = ShardInfo(name=name, split="train", clips=0, bytes=int(size), sha256="")
with ShardCache(Path(folder), digest, 3072).reserved(shard) as file:
    file.write(bytes(int(size) // 2))
    print("half", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("then", [[7], [0, 1, 2]], ids=["the same", "others"])
def test_what_a_killed_download_left_is_never_believed_and_makes_way(cache, folder, then):
    one = shard(7, 2 * KIB)
    command = [sys.executable, "-c", DIES_IN_A_DOWNLOAD, str(folder), DIGEST, one.name, str(one.bytes)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"half\n"
            with cache.reserved(one) as none:
                assert none is None
        finally:
            process.send_signal(signal.SIGKILL)
    assert names(folder) == [f".{one.name}.partial"]
    assert not cache.has(one)
    put(cache, *map(shard, then))
    assert names(folder) == [shard(number).name for number in then]


@settings(max_examples=40)
@given(st.lists(st.tuples(st.sampled_from(["put", "begin", "end", "remove"]), st.integers(0, 5)), max_size=40))
def test_the_bound_holds_whatever_happens(tmp_path_factory, steps):
    folder = tmp_path_factory.mktemp("cache")
    cache, underway = ShardCache(folder, DIGEST, 4 * KIB), []
    shards = [shard(number, KIB * (1 + number % 3)) for number in range(6)]
    for step, number in steps:
        if step in ("put", "begin"):
            reserved = cache.reserved(shards[number])
            if reserved.__enter__() is not None:
                underway.append(reserved)
        if step in ("put", "end") and underway:
            underway.pop().__exit__(None, None, None)
        if step == "remove":
            cache.remove(shards[number])
        assert bytes_in(folder) <= 4 * KIB
    for reserved in underway:
        reserved.__exit__(None, None, None)
    assert not [name for name in names(folder) if name.endswith(".partial")]
