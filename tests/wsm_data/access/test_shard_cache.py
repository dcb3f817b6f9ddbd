"""The files of the cache: bounded at every moment, believed only when finished, safe against the death of a process."""

import os
import signal
import subprocess
import sys
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.access.shard_cache import CachedShard, Refusal, ShardCache
from wsm_data.errors import ConfigError

KIB = 1024
DIGEST = "d" * 64


def shard(number, size=KIB):
    return CachedShard(digest=DIGEST, name=f"train-{number:06d}.tar", bytes=size, sha256="")


def put(cache, *shards, keep=()):
    for one in shards:
        with cache.begin(one, keep=keep, must=True) as download:
            download.write(memoryview(bytes(one.bytes)))
            download.finish()


def names(folder):
    return sorted(path.name for path in folder.glob("*/*"))


def bytes_in(folder):
    return sum(path.stat().st_size for path in folder.rglob("*")) - sum(
        path.stat().st_size for path in folder.rglob("*") if path.is_dir()
    )


def has(cache, one):
    with cache.opened(one) as descriptor:
        return descriptor is not None


@pytest.fixture
def cache(tmp_path):
    return ShardCache(tmp_path / "cache", 3 * KIB)


def test_what_was_finished_is_there_and_what_was_not_is_not(cache, tmp_path):
    put(cache, shard(0))
    with cache.begin(shard(1), keep=(), must=True) as download:
        download.write(memoryview(bytes(KIB)))
    assert has(cache, shard(0))
    assert not has(cache, shard(1))
    assert names(tmp_path / "cache") == ["train-000000.tar"]


def test_an_error_gives_the_room_back(cache, tmp_path):
    with pytest.raises(ZeroDivisionError), cache.begin(shard(0), keep=(), must=True):
        raise ZeroDivisionError
    assert names(tmp_path / "cache") == []
    put(cache, shard(0))


def test_nothing_is_believed_before_it_is_finished(cache):
    with cache.begin(shard(0), keep=(), must=True) as download:
        download.write(memoryview(bytes(KIB)))
        assert not has(cache, shard(0))
        download.finish()
    assert has(cache, shard(0))


def test_room_is_taken_before_the_first_byte_comes(cache, tmp_path):
    with cache.begin(shard(0, 2 * KIB), keep=(), must=True):
        assert bytes_in(tmp_path / "cache") == 2 * KIB
        assert cache.begin(shard(1, 2 * KIB), keep=(), must=True) is Refusal.NO_ROOM
        assert bytes_in(tmp_path / "cache") == 2 * KIB


def test_what_is_there_or_underway_is_not_begun_again(cache):
    with cache.begin(shard(0), keep=(), must=True) as download:
        assert cache.begin(shard(0), keep=(), must=True) is Refusal.UNDERWAY
        download.write(memoryview(bytes(KIB)))
        download.finish()
    assert cache.begin(shard(0), keep=(), must=True) is Refusal.PRESENT


def test_the_least_recently_used_goes_first(cache, tmp_path):
    put(cache, shard(0), shard(1), shard(2))
    assert has(cache, shard(0))  # which is a use
    put(cache, shard(3))
    assert names(tmp_path / "cache") == [shard(0).name, shard(2).name, shard(3).name]


def test_what_should_stay_stays_unless_there_is_no_other_way(cache, tmp_path):
    put(cache, shard(0), shard(1), shard(2))
    put(cache, shard(3), keep=[shard(0)])
    assert names(tmp_path / "cache") == [shard(0).name, shard(2).name, shard(3).name]
    everything = [shard(0), shard(2), shard(3)]
    assert cache.begin(shard(4), keep=everything, must=False) is Refusal.NO_ROOM
    assert names(tmp_path / "cache") == [one.name for one in everything]
    put(cache, shard(4), keep=everything)
    assert names(tmp_path / "cache") == [shard(2).name, shard(3).name, shard(4).name]


def test_nothing_is_removed_for_what_will_not_fit_anyway(cache, tmp_path):
    put(cache, shard(0))
    with cache.begin(shard(1, 2 * KIB), keep=(), must=True):
        assert cache.begin(shard(2, 2 * KIB), keep=(), must=True) is Refusal.NO_ROOM
        assert has(cache, shard(0))


def test_what_is_being_read_is_not_removed(cache):
    put(cache, shard(0, 3 * KIB))
    with cache.opened(shard(0, 3 * KIB)) as descriptor:
        assert cache.begin(shard(1), keep=(), must=True) is Refusal.NO_ROOM
        assert len(os.pread(descriptor, 4 * KIB, 0)) == 3 * KIB
    put(cache, shard(1))


def test_who_downloaded_a_shard_gets_to_read_it(cache):
    with cache.begin(shard(0, 3 * KIB), keep=(), must=True) as download:
        download.write(memoryview(bytes(range(256)) * 12))
        download.finish()
        assert cache.begin(shard(1), keep=(), must=True) is Refusal.NO_ROOM
        assert os.pread(download.descriptor, 4, 256) == bytes(range(4))


def test_a_shard_of_another_size_is_not_believed_and_makes_way(cache, tmp_path):
    put(cache, shard(0))
    os.truncate(tmp_path / "cache" / DIGEST / shard(0).name, 100)
    assert not has(cache, shard(0))
    put(cache, shard(0))
    assert has(cache, shard(0))


def test_a_removed_shard_may_be_read_on_by_who_has_it_open(cache):
    put(cache, shard(0))
    with cache.opened(shard(0)) as descriptor:
        cache.remove(shard(0))
        cache.remove(shard(0))
        assert len(os.pread(descriptor, KIB, 0)) == KIB
    assert not has(cache, shard(0))


def test_nothing_is_removed_while_somebody_makes_room(cache):
    put(cache, shard(0))
    removing = threading.Thread(target=cache.remove, args=(shard(0),))
    with cache.locked():
        removing.start()
        removing.join(timeout=0.2)
        assert removing.is_alive()
        assert has(cache, shard(0))
    removing.join(timeout=20)
    assert not has(cache, shard(0))


def test_releases_share_the_room(cache, tmp_path):
    other = CachedShard(digest="e" * 64, name=shard(0).name, bytes=2 * KIB, sha256="")
    put(cache, shard(0), shard(1), other)
    assert names(tmp_path / "cache") == [shard(0).name, shard(1).name]  # the younger one, and that of the other release
    assert has(cache, other)
    assert not has(cache, shard(0))


def test_files_of_others_are_neither_counted_nor_removed(cache, tmp_path):
    foreign = tmp_path / "cache" / "notes.txt"
    foreign.write_bytes(bytes(9 * KIB))
    put(cache, shard(0), shard(1), shard(2), shard(3))
    assert foreign.stat().st_size == 9 * KIB


def test_a_limit_below_one_shard_is_refused_with_the_least_that_would_do(cache):
    cache.require_room_for([shard(0), shard(1, 3 * KIB)])
    with pytest.raises(ConfigError, match=rf"at least {(4 * KIB) / 2**30:.6f} to hold train-000001.tar of 4096 bytes"):
        cache.require_room_for([shard(0), shard(1, 4 * KIB)])


def test_a_restart_finds_what_was_finished(cache, tmp_path):
    put(cache, shard(0))
    assert has(ShardCache(tmp_path / "cache", 3 * KIB), shard(0))


DIES_IN_A_DOWNLOAD = """
import sys, time
from pathlib import Path
from wsm_data.access.shard_cache import CachedShard, ShardCache
shard = CachedShard(digest=sys.argv[2], name=sys.argv[3], bytes=int(sys.argv[4]), sha256="")
with ShardCache(Path(sys.argv[1]), 3072).begin(shard, keep=(), must=True) as download:
    download.write(memoryview(bytes(int(sys.argv[4]) // 2)))
    print("half", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def killed_download(tmp_path):
    """Leaves what a download leaves that is killed in the middle; returns the shard."""
    one = shard(7, 2 * KIB)
    command = [sys.executable, "-c", DIES_IN_A_DOWNLOAD, str(tmp_path / "cache"), DIGEST, one.name, str(one.bytes)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"half\n"
            assert ShardCache(tmp_path / "cache", 3 * KIB).begin(one, keep=(), must=True) is Refusal.UNDERWAY
        finally:
            process.send_signal(signal.SIGKILL)
    assert names(tmp_path / "cache") == [f".{one.name}.partial"]
    return one


def test_what_a_killed_download_left_is_not_believed_and_is_written_anew(killed_download, cache):
    assert not has(cache, killed_download)
    put(cache, killed_download)
    assert has(cache, killed_download)


def test_what_a_killed_download_left_makes_way_for_others(killed_download, cache, tmp_path):
    put(cache, shard(0), shard(1), shard(2))
    assert names(tmp_path / "cache") == [shard(0).name, shard(1).name, shard(2).name]


@settings(max_examples=40)
@given(
    st.lists(
        st.tuples(st.sampled_from(["put", "begin", "end", "read", "remove"]), st.integers(0, 5), st.booleans()),
        max_size=40,
    )
)
def test_the_bound_holds_whatever_happens(tmp_path_factory, steps):
    folder = tmp_path_factory.mktemp("cache")
    cache, underway = ShardCache(folder, 4 * KIB), []
    shards = [shard(number, KIB * (1 + number % 3)) for number in range(6)]
    for step, number, must in steps:
        one = shards[number]
        if step in ("put", "begin"):
            begun = cache.begin(one, keep=shards[:2], must=must)
            if not isinstance(begun, Refusal):
                underway.append(begun)
                if step == "put":
                    begun.write(memoryview(bytes(one.bytes)))
                    begun.finish()
        if step in ("put", "end") and underway:
            underway.pop().__exit__()
        if step == "read" and has(cache, one):
            assert (folder / DIGEST / one.name).stat().st_size == one.bytes
        if step == "remove":
            cache.remove(one)
        assert bytes_in(folder) <= 4 * KIB
    for download in underway:
        download.__exit__()
    assert not [name for name in names(folder) if name.endswith(".partial")]
