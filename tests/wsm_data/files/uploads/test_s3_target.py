"""Uploads to S3: in parts of 5 MiB (the least that S3 takes), resumed where they were cut, compared by ETag."""

import hashlib
from functools import partial

import pytest
from fault_proxy import Fault

from wsm_data.errors import StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.retries import RequestConfig
from wsm_data.files.uploads.local_file import look_at
from wsm_data.files.uploads.s3_target import S3Target

MIB = 1 << 20
PARTS = r"partNumber=\d+.*uploadId|uploadId.*partNumber=\d+"
md5 = partial(hashlib.md5, usedforsecurity=False)


@pytest.fixture
def target(bucket):
    return S3Target(FsspecStore(f"{bucket[0]}/release", RequestConfig(attempts=3, first_backoff_s=0.01)))


@pytest.fixture
def file(tmp_path):
    """Three parts: 5, 5 and 2 MiB."""
    (tmp_path / "shard").write_bytes(bytes(range(256)) * (12 * MIB // 256))
    return look_at(tmp_path / "shard", 5 * MIB)


@pytest.fixture
def small(tmp_path):
    (tmp_path / "small").write_bytes(b"index")
    return look_at(tmp_path / "small", 5 * MIB)


def unfinished(bucket):
    url, client = bucket
    return client.list_multipart_uploads(Bucket=url.removeprefix("s3://")).get("Uploads", [])


def puts(proxy):
    return [one for one in proxy.requests() if one.method == "PUT" and one.fault is None]


def test_a_file_of_one_part_is_put_at_once(target, small, store_proxy, bucket):
    target.put("index", small)
    assert target.store.read("index") == b"index"
    assert target.checksum("index") == f"etag:{md5(b'index').hexdigest()}"
    assert (len(puts(store_proxy)), unfinished(bucket)) == (1, [])


def test_a_file_of_several_parts_is_completed_and_compared(target, file, store_proxy, bucket):
    target.put("shard", file)
    assert target.store.read("shard") == file.path.read_bytes()
    assert target.checksum("shard") == f"etag:{file.etag}"
    assert (len(puts(store_proxy)), unfinished(bucket)) == (3, [])


def test_a_part_that_fails_is_sent_again(target, file, store_proxy):
    store_proxy.spoil("partNumber=2", Fault.SLOW_DOWN, method="PUT")
    store_proxy.spoil("partNumber=3", Fault.RESET, method="PUT")
    target.put("shard", file)
    assert target.holds("shard", file)


def test_an_upload_that_was_cut_goes_on_with_the_parts_that_are_missing(target, file, store_proxy, bucket):
    store_proxy.spoil("partNumber=3", Fault.SLOW_DOWN, times=3, method="PUT")
    with pytest.raises(StoreError, match="no answer in 3 attempts"):
        target.put("shard", file)
    assert not target.store.exists("shard")
    assert len(unfinished(bucket)) == 1
    before = len(puts(store_proxy))
    target.put("shard", file)
    assert len(puts(store_proxy)) - before == 1
    assert target.holds("shard", file)
    assert unfinished(bucket) == []


def test_parts_of_other_bytes_are_not_gone_on_with(target, file, tmp_path, store_proxy):
    (tmp_path / "other").write_bytes(b"x" * 5 * MIB + file.path.read_bytes()[5 * MIB :])
    store_proxy.spoil("partNumber=3", Fault.SLOW_DOWN, times=3, method="PUT")
    with pytest.raises(StoreError):
        target.put("shard", look_at(tmp_path / "other", 5 * MIB))
    before = len(puts(store_proxy))
    target.put("shard", file)
    assert len(puts(store_proxy)) - before == 2  # the first part and the third; the second is the same
    assert target.store.read("shard") == file.path.read_bytes()


def test_of_several_unfinished_uploads_one_is_gone_on_with_and_the_others_given_up(target, file, bucket):
    url, client = bucket
    name = url.removeprefix("s3://")
    for _ in range(3):
        client.create_multipart_upload(Bucket=name, Key="release/shard")
    client.create_multipart_upload(Bucket=name, Key="release/shard-of-others")
    target.put("shard", file)
    assert [one["Key"] for one in unfinished(bucket)] == ["release/shard-of-others"]


def test_a_completion_whose_answer_is_lost_is_no_failure(target, file, store_proxy, monkeypatch):
    """The store completes, the client hears nothing and asks again, and there is no such upload any more."""
    forward = store_proxy.forward
    lost = []

    def lose(method, path, headers, body):
        answer = forward(method, path, headers, body)
        if method == "POST" and "uploadId" in path and not lost:
            lost.append(path)
            raise ConnectionError
        return answer

    monkeypatch.setattr(store_proxy, "forward", lose)
    target.put("shard", file)
    assert len(lost) == 1
    assert target.holds("shard", file)


def test_other_bytes_of_the_same_size_are_not_held(target, small, bucket):
    url, client = bucket
    client.put_object(Bucket=url.removeprefix("s3://"), Key="release/index", Body=b"inDex")
    assert not target.holds("index", small)


def test_an_object_in_other_parts_is_held_when_its_bytes_are_read(target, file, bucket):
    url, client = bucket
    client.upload_file(str(file.path), url.removeprefix("s3://"), "release/shard")  # in parts of 8 MiB
    assert target.checksum("shard") != f"etag:{file.etag}"
    assert target.holds("shard", file)


def test_what_is_absent_is_not_held_and_has_no_checksum(target, small):
    assert not target.holds("index", small)
    assert target.checksum("index") == ""
