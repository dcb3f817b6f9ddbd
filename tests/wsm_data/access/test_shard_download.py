"""A shard comes whole and hashed, or not at all."""

from dataclasses import replace

import pytest
from fault_proxy import Fault

from wsm_data.access.ranges import open_remote_store
from wsm_data.access.shard_download import download
from wsm_data.errors import IntegrityError, StoreError

FOREVER = 10**9


@pytest.fixture
def downloaded(remote, published, tmp_path, monkeypatch):
    """Downloads the first shard in parts of 10,000 bytes; returns its bytes."""
    monkeypatch.setattr("wsm_data.access.shard_download._PART_BYTES", 10_000)
    stores = []

    def run(attempts=3, **changes):
        stores.append(open_remote_store(remote.url, remote.read(attempts=attempts)))
        with (tmp_path / "shard").open("w+b") as file:
            download(replace(published.manifest.shards[0], **changes), stores[-1], file, 4)
        return (tmp_path / "shard").read_bytes()

    yield run
    stores[-1].close()


def whole(published):
    return (published.folder / published.manifest.shards[0].name).read_bytes()


def test_a_shard_comes_in_parts_side_by_side(downloaded, published, remote):
    assert downloaded() == whole(published)
    ranges = [passed.range for passed in remote.proxy.requests(r"\.tar")]
    assert len(set(ranges)) == len(ranges) == -(-published.manifest.shards[0].bytes // 10_000)


def test_parts_that_fail_are_asked_for_again(downloaded, published, remote):
    for fault in (Fault.SLOW_DOWN, Fault.RESET, Fault.RESET_IN_BODY, Fault.CUT_BODY, Fault.SHORT_BODY):
        remote.proxy.spoil(r"\.tar", fault)
    assert downloaded(attempts=6) == whole(published)


def test_a_part_that_was_damaged_on_the_way_is_noticed_and_all_fetched_again(downloaded, published, remote, caplog):
    remote.proxy.spoil(r"\.tar", Fault.WRONG_BYTES)
    assert downloaded() == whole(published)
    assert "train-000000.tar was downloaded with a wrong sha256" in caplog.text


def test_a_shard_that_stays_damaged_is_an_error_that_names_it_and_both_digests(downloaded, published, remote):
    remote.proxy.spoil(r"\.tar", Fault.WRONG_BYTES, FOREVER)
    info = published.manifest.shards[0]
    with pytest.raises(
        IntegrityError, match=rf"{remote.url}/{info.name} must have sha256 {info.sha256}, found \w{{64}}"
    ):
        downloaded()


def test_a_store_that_fails_for_good_is_an_error_that_names_the_shard(downloaded, published, remote):
    remote.proxy.spoil(r"\.tar", Fault.SLOW_DOWN, FOREVER)
    with pytest.raises(StoreError, match=f"{remote.url}/{published.manifest.shards[0].name}: no answer in 3 attempts"):
        downloaded()


def test_a_shard_that_is_shorter_than_the_manifest_says_is_named(downloaded, published):
    with pytest.raises(IntegrityError, match=f"ends at byte {published.manifest.shards[0].bytes}"):
        downloaded(bytes=published.manifest.shards[0].bytes + 5)


def test_a_shard_that_is_missing_is_named(downloaded):
    with pytest.raises(IntegrityError, match=r"train-999999\.tar is missing from s3://"):
        downloaded(name="train-999999.tar")
