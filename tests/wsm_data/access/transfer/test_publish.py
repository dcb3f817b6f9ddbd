"""A release behind a URL is the release: checked by `verify_release`, resumed after faults, with dataset.json last."""

import pytest
from fault_proxy import Fault
from tiny_release import build_clip, pack

from wsm_data.access.transfer import publish as module
from wsm_data.access.transfer.published import PUBLISHED_NAME, read_published
from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError, IntegrityError, StoreError
from wsm_data.files.stores import open_store
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.names import MANIFEST_NAME


@pytest.fixture(params=["memory", "file", "s3", "hub"])
def url(request, tmp_path):
    if request.param == "s3":
        return request.getfixturevalue("bucket")[0] + "/release"
    if request.param == "hub":
        request.getfixturevalue("hub")
        return "hf://datasets/someone/homes"
    return {"memory": f"memory://published-{tmp_path.name}", "file": f"file://{tmp_path}/there"}[request.param]


@pytest.fixture
def other(tmp_path):
    """Another release, of fewer shards."""
    folder = tmp_path / "other"
    pack(folder, [build_clip("synth_d435i/home_0009/000001")], shard_bytes=200_000)
    return folder


def test_every_store_holds_the_release_and_a_second_call_sends_nothing(url, publish, tiny):
    moved = publish(url)
    assert verify_release(url) == []
    assert moved.files == moved.moved_files == len(tiny.manifest.shards) + 4
    assert publish(url).moved_files == 0


def test_a_file_that_was_lost_or_changed_there_is_sent_again(publish, memory_url, tiny):
    publish(memory_url)
    target = FsspecTarget(open_store(memory_url))
    target.remove("index.parquet")
    target.store.call("touch", tiny.manifest.shards[0].name)  # empties it
    assert publish(memory_url).moved_files == 2
    assert verify_release(memory_url) == []


def test_the_manifest_comes_when_all_else_is_there(publish, memory_url, monkeypatch):
    order = []
    put = FsspecTarget.put
    monkeypatch.setattr(FsspecTarget, "put", lambda self, name, file: (order.append(name), put(self, name, file)))
    publish(memory_url, about={"README.md": b"card"})
    assert order[-3:] == ["README.md", PUBLISHED_NAME, MANIFEST_NAME]


def test_killed_before_any_file_the_next_call_completes_what_is_missing(publish, memory_url, monkeypatch, tiny):
    put, files = FsspecTarget.put, len(tiny.manifest.shards) + 5  # published.json among them
    for survived in range(files):
        left = [survived]

        def dying(self, name, file, left=left):
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            put(self, name, file)

        url = f"{memory_url}-{survived}"
        monkeypatch.setattr(FsspecTarget, "put", dying)
        with pytest.raises(KeyboardInterrupt):
            publish(url, threads=1)
        assert not open_store(url).exists(MANIFEST_NAME)
        monkeypatch.setattr(FsspecTarget, "put", put)
        publish(url)
        assert verify_release(url) == []


def test_a_store_that_fails_one_request_in_five_gets_the_release_all_the_same(bucket, publish, store_proxy):
    store_proxy.fail_every(5)
    publish(f"{bucket[0]}/release")
    store_proxy.fail_every(0)
    assert store_proxy.spoiled() > 3
    assert verify_release(f"{bucket[0]}/release") == []


def test_a_store_that_refuses_ends_it_without_a_manifest(bucket, publish, store_proxy):
    store_proxy.spoil("index.parquet", Fault.FORBIDDEN, times=9, method="PUT")
    with pytest.raises(StoreError, match="refuses"):
        publish(f"{bucket[0]}/release")
    assert not open_store(f"{bucket[0]}/release").exists(MANIFEST_NAME)


def test_another_release_is_overwritten_only_where_that_is_asked_for(publish, memory_url, other, tiny):
    publish(memory_url)
    with pytest.raises(ConfigError, match="--replace"):
        publish(memory_url, other)
    assert verify_release(memory_url) == []
    publish(memory_url, other, replace=True)
    assert verify_release(memory_url) == []  # no shard of the first is left
    assert open_store(memory_url).read(MANIFEST_NAME) == (other / MANIFEST_NAME).read_bytes()


def test_a_release_that_was_changed_since_it_was_packed_is_not_published(publish, memory_url, tiny):
    shard = tiny.folder / tiny.manifest.shards[0].name
    data = shard.read_bytes()
    shard.write_bytes(data[:700] + b"\xff" + data[701:])
    with pytest.raises(IntegrityError, match=r"must have sha256 .* changed since it was packed"):
        publish(memory_url)
    shard.unlink()
    with pytest.raises(IntegrityError, match="is missing"):
        publish(memory_url)
    assert not open_store(memory_url).exists(MANIFEST_NAME)


def test_what_the_store_said_of_each_file_stands_beside_them(bucket, publish, tiny):
    url = f"{bucket[0]}/release"
    publish(url)
    published = read_published(open_store(url))
    shard = tiny.manifest.shards[0]
    assert published.release == release_digest(tiny.manifest)
    assert published.files[shard.name].size_bytes == shard.bytes
    assert published.files[shard.name].checksum.startswith("etag:")
    assert module.MANIFEST_NAME not in published.files
