"""A published release is looked at without reading a shard: sizes, and what the store says of its bytes."""

import pytest

from wsm_data.access.transfer.stored import check_stored
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.stores import open_store
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.shards.findings import FindingKind
from wsm_data.shards.names import INDEX_NAME, MANIFEST_NAME


@pytest.fixture
def s3_url(bucket, publish):
    publish(f"{bucket[0]}/release")
    return f"{bucket[0]}/release"


def test_no_shard_is_read(s3_url, tiny, monkeypatch):
    read = []
    for method in ("read", "read_range"):
        inner = getattr(FsspecStore, method)
        watching = lambda self, name, *rest, inner=inner: (read.append(name), inner(self, name, *rest))[1]  # noqa: E731
        monkeypatch.setattr(FsspecStore, method, watching)
    check = check_stored(s3_url)
    assert (check.findings, check.shards, check.by_checksum) == ((), 3, 3)
    assert len(tiny.manifest.shards) == 3
    assert not [name for name in read if name.endswith(".tar")]


def test_bytes_that_were_changed_in_their_size_are_found_by_the_checksum(s3_url, bucket, tiny):
    shard = tiny.manifest.shards[0]
    name = bucket[0].removeprefix("s3://")
    bucket[1].put_object(Bucket=name, Key=f"release/{shard.name}", Body=b"x" * shard.bytes)
    [finding] = check_stored(s3_url).findings
    assert (finding.kind, finding.shard) == (FindingKind.SHARD_CHANGED, shard.name)


def test_a_store_without_checksums_is_looked_at_by_sizes(publish, memory_url, tiny, tmp_path):
    publish(memory_url)
    assert check_stored(memory_url).by_checksum == 0
    (tmp_path / "cut").write_bytes(b"cut")
    target = FsspecTarget(open_store(memory_url))
    target.store.put_file(tiny.manifest.shards[0].name, tmp_path / "cut")
    target.remove(tiny.manifest.shards[1].name)
    kinds = [finding.kind for finding in check_stored(memory_url).findings]
    assert kinds == [FindingKind.SHARD_SIZE, FindingKind.SHARD_MISSING]


def test_index_and_manifest_are_read_whole(publish, memory_url, tmp_path):
    publish(memory_url)
    target = FsspecTarget(open_store(memory_url))
    (tmp_path / "cut").write_bytes(b"cut")
    target.store.put_file(INDEX_NAME, tmp_path / "cut")
    assert {finding.kind for finding in check_stored(memory_url).findings} == {FindingKind.FILE_CHANGED}
    target.store.put_file(MANIFEST_NAME, tmp_path / "cut")
    [finding] = check_stored(memory_url).findings
    assert finding.kind is FindingKind.RELEASE_UNREADABLE


def test_a_folder_has_sizes_alone(tiny):
    assert (check_stored(str(tiny.folder)).findings, check_stored(str(tiny.folder)).by_checksum) == ((), 0)
