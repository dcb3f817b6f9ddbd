"""A shard comes whole and hashed, or not at all."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from fault_proxy import Fault

from wsm_data.access.ranges import open_remote_store
from wsm_data.access.shard_cache import CachedShard, ShardCache
from wsm_data.access.shard_download import fill
from wsm_data.errors import IntegrityError, StoreError
from wsm_data.shards.manifest import release_digest

FOREVER = 10**9


@pytest.fixture
def download(remote, published, tmp_path, monkeypatch):
    """Downloads the first shard in parts of 10,000 bytes; returns its bytes in the cache."""
    monkeypatch.setattr("wsm_data.access.shard_download._PART_BYTES", 10_000)
    info = published.manifest.shards[0]
    stores = []

    def run(attempts=3, **changes):
        stores.append(open_remote_store(remote.url, remote.read(attempts=attempts)))
        values = {"digest": release_digest(published.manifest), "name": info.name} | {
            "bytes": info.bytes,
            "sha256": info.sha256,
        }
        shard = CachedShard(**(values | changes))
        cache = ShardCache(tmp_path / "cache", 1 << 30)
        with ThreadPoolExecutor(4) as threads, cache.begin(shard, keep=(), must=True) as room:
            fill(shard, room, stores[-1], threads, 4)
        return (tmp_path / "cache" / shard.digest / shard.name).read_bytes()

    yield run
    stores[-1].close()
    assert not list((tmp_path / "cache").glob("*/.*.partial"))


def whole(published):
    return (published.folder / published.manifest.shards[0].name).read_bytes()


def test_a_shard_comes_in_parts_side_by_side(download, published, remote):
    assert download() == whole(published)
    ranges = [passed.range for passed in remote.proxy.requests(r"\.tar")]
    assert len(set(ranges)) == len(ranges) == -(-published.manifest.shards[0].bytes // 10_000)


def test_parts_that_fail_are_asked_for_again(download, published, remote):
    for fault in (Fault.SLOW_DOWN, Fault.RESET, Fault.RESET_IN_BODY, Fault.CUT_BODY, Fault.SHORT_BODY):
        remote.proxy.spoil(r"\.tar", fault)
    assert download(attempts=6) == whole(published)


def test_a_part_that_was_damaged_on_the_way_is_noticed_and_the_shard_fetched_again(download, published, remote, caplog):
    remote.proxy.spoil(r"\.tar", Fault.WRONG_BYTES)
    assert download() == whole(published)
    assert "train-000000.tar: download 1 has a wrong sha256" in caplog.text


def test_a_shard_that_stays_damaged_is_an_error_that_names_it_and_both_digests(download, published, remote, tmp_path):
    remote.proxy.spoil(r"\.tar", Fault.WRONG_BYTES, FOREVER)
    info = published.manifest.shards[0]
    with pytest.raises(
        IntegrityError, match=rf"{remote.url}/{info.name} must have sha256 {info.sha256}, found \w{{64}}"
    ):
        download()
    assert not list((tmp_path / "cache").glob("*/*.tar"))


def test_a_store_that_fails_for_good_is_an_error_that_names_the_shard(download, published, remote, tmp_path):
    remote.proxy.spoil(r"\.tar", Fault.SLOW_DOWN, FOREVER)
    with pytest.raises(StoreError, match=f"{remote.url}/{published.manifest.shards[0].name}: no answer in 3 attempts"):
        download()
    assert not list((tmp_path / "cache").glob("*/*.tar"))


def test_a_shard_that_is_shorter_than_the_manifest_says_is_named(download, published):
    with pytest.raises(IntegrityError, match=f"ends at byte {published.manifest.shards[0].bytes}"):
        download(bytes=published.manifest.shards[0].bytes + 5)


def test_a_shard_that_is_missing_is_named(download):
    with pytest.raises(IntegrityError, match=r"train-999999\.tar is missing from s3://"):
        download(name="train-999999.tar")
