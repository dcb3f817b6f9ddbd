"""Shards through the cache: the same bytes under every fault, within the bound, for one process or several."""

import threading
import time

import pytest
from fault_proxy import Fault

from wsm_data.access.cached_shards import CachedShards
from wsm_data.access.shard_reader import Span
from wsm_data.errors import ConfigError, IntegrityError, StoreError

GIB = 1 << 30
FOREVER = 10**9


@pytest.fixture
def open_reader(remote, address, published, tmp_path):
    """Opens readers that share a cache of two and a half shards, and closes them at the end."""
    readers = []
    limit = max(shard.bytes for shard in published.manifest.shards) * 2.5

    def open_one(**changes):
        settings = {"cache_dir": str(tmp_path / "cache"), "cache_gib": limit / GIB} | changes
        readers.append(CachedShards(address, published.manifest, remote.read(**settings)))
        return readers[-1]

    open_one.limit = limit
    yield open_one
    for reader in readers:
        reader.close()
    assert not list((tmp_path / "cache").glob("*/.*.partial"))


def read_clip(reader, span):
    target = bytearray(span.size)
    view = memoryview(target)
    reader.read_into(span.shard, span.offset, [view[:100], view[100:100], view[100:]])
    return bytes(target)


def read_until_closed(reader, span, outcomes):
    try:
        read_clip(reader, span)
    except StoreError as error:
        outcomes.append(str(error))


def shards_of(published):
    return [shard.name for shard in published.manifest.shards]


def first_spans(published):
    return [next(span for span in published.spans if span.shard == name) for name in shards_of(published)]


def cached(tmp_path):
    return {path.name for path in (tmp_path / "cache").glob("*/*.tar")}


def wait_for(condition, seconds=30.0):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.parametrize("is_announced", [True, False])
def test_what_is_read_is_what_is_stored(open_reader, published, is_announced):
    reader = open_reader()
    if is_announced:
        reader.expect(published.spans)
    for span in (*published.spans, *published.spans[::-3]):
        assert read_clip(reader, span) == published.bytes_of(span)


def test_a_shard_is_downloaded_once_however_many_threads_want_it(open_reader, published, remote):
    reader, shard = open_reader(), shards_of(published)[0]
    spans = [span for span in published.spans if span.shard == shard]
    reader.expect(spans)
    threads = [threading.Thread(target=read_clip, args=(reader, span)) for span in spans]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=120)
    assert len(remote.proxy.requests(shard)) == 1


def test_what_was_announced_is_fetched_in_its_order_as_far_as_the_cache_holds(open_reader, published, remote, tmp_path):
    reader, spans = open_reader(), first_spans(published)
    reader.expect(spans)
    wait_for(lambda: cached(tmp_path) == set(shards_of(published)[:2]))
    time.sleep(0.1)
    assert {passed.path.rsplit("/", 1)[1] for passed in remote.proxy.requests(r"\.tar")} == cached(tmp_path)
    assert read_clip(reader, spans[0]) == published.bytes_of(spans[0])
    wait_for(lambda: shards_of(published)[2] in cached(tmp_path))  # now that the first one is not needed any more
    assert shards_of(published)[1] in cached(tmp_path)


def test_the_bound_holds_at_every_moment(open_reader, published, tmp_path):
    sizes, done = [], threading.Event()

    def watch():
        while not done.is_set():
            files = [path for path in (tmp_path / "cache").rglob("*") if path.suffix in (".tar", ".partial")]
            total = 0
            for path in files:
                try:
                    total += path.stat().st_blocks * 512
                except FileNotFoundError:
                    continue
            sizes.append(total)

    reader = open_reader()
    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        for _ in range(2):
            reader.expect(first_spans(published))
            for span in first_spans(published):
                assert read_clip(reader, span) == published.bytes_of(span)
    finally:
        done.set()
        watcher.join()
    assert 0 < max(sizes) <= open_reader.limit + 8192  # blocks of the file system


FAULTS = (Fault.SLOW_DOWN, Fault.RESET, Fault.RESET_IN_BODY, Fault.CUT_BODY, Fault.SHORT_BODY)


@pytest.mark.parametrize(
    "faults",
    [(*FAULTS, Fault.WRONG_BYTES), *(pytest.param((fault,) * 4, marks=pytest.mark.slow) for fault in FAULTS)],
    ids=" ".join,
)
def test_faults_that_pass_change_nothing(open_reader, published, remote, faults):
    reader = open_reader(attempts=len(FAULTS) + 1)
    for fault in faults:
        remote.proxy.spoil(r"\.tar", fault)
    reader.expect(published.spans)
    assert [read_clip(reader, span) for span in published.spans] == [
        published.bytes_of(span) for span in published.spans
    ]
    assert remote.proxy.spoiled() == len(faults)


def test_a_shard_that_cannot_be_fetched_in_advance_is_named_once(
    open_reader, published, remote, address, tmp_path, caplog
):
    bad = shards_of(published)[0]
    remote.proxy.spoil(bad, Fault.RESET, FOREVER)
    reader = open_reader(attempts=1)
    reader.expect(first_spans(published))
    wait_for(lambda: shards_of(published)[1] in cached(tmp_path))
    reader.close()
    said = [record.getMessage() for record in caplog.records if "in advance" in record.getMessage()]
    assert [message.partition(" ")[0] for message in said] == [f"{address}/{bad}"]


def test_a_store_that_fails_for_good_is_an_error_that_names_the_shard(open_reader, published, remote, address):
    reader = open_reader(attempts=2)
    bad = shards_of(published)[1]
    remote.proxy.spoil(bad, Fault.RESET_IN_BODY, FOREVER)
    reader.expect(first_spans(published))
    for span in first_spans(published):
        if span.shard == bad:
            with pytest.raises(StoreError, match=f"{address}/{bad}: no answer in 2 attempts"):
                read_clip(reader, span)
        else:
            assert read_clip(reader, span) == published.bytes_of(span)


def test_a_shard_that_stays_damaged_is_never_read(open_reader, published, remote):
    reader = open_reader()
    remote.proxy.spoil(shards_of(published)[0], Fault.WRONG_BYTES, FOREVER)
    with pytest.raises(IntegrityError, match=f"{shards_of(published)[0]} must have sha256"):
        read_clip(reader, published.spans[0])


def test_a_shard_that_the_release_does_not_have_is_named(open_reader):
    with pytest.raises(IntegrityError, match=r"train-999999\.tar is missing from \w+://"):
        read_clip(open_reader(), Span("train-999999.tar", 0, 200))


def test_a_stretch_that_leaves_its_shard_is_not_read(open_reader, published):
    shard = published.manifest.shards[0]
    with pytest.raises(IntegrityError, match=f"{shard.name} .*ends at byte {shard.bytes}"):
        read_clip(open_reader(), Span(shard.name, shard.bytes - 100, 300))


def test_another_reader_of_the_same_cache_asks_the_store_for_nothing(open_reader, published, remote):
    span = published.spans[0]
    read_clip(open_reader(), span)
    before = len(remote.proxy.requests())
    assert read_clip(open_reader(), span) == published.bytes_of(span)
    assert len(remote.proxy.requests()) == before


def test_a_forgotten_shard_is_downloaded_again(open_reader, published, remote, tmp_path):
    reader, span = open_reader(), published.spans[0]
    read_clip(reader, span)
    path = next((tmp_path / "cache").glob(f"*/{span.shard}"))
    path.write_bytes(bytes(path.stat().st_size))
    assert read_clip(reader, span) == bytes(span.size)
    reader.forget(span.shard)
    assert read_clip(reader, span) == published.bytes_of(span)


def test_a_cache_of_one_shard_works(open_reader, published):
    reader = open_reader(cache_gib=max(shard.bytes for shard in published.manifest.shards) / GIB)
    for _ in range(4):
        for span in first_spans(published):
            assert read_clip(reader, span) == published.bytes_of(span)


def test_a_cache_that_cannot_hold_a_shard_is_refused(open_reader, published):
    largest = max(shard.bytes for shard in published.manifest.shards)
    with pytest.raises(ConfigError, match=f"cache_gib must be at least .* of {largest} bytes"):
        open_reader(cache_gib=(largest - 1) / GIB)


def test_a_cache_without_a_folder_is_refused(open_reader):
    with pytest.raises(ConfigError, match="cache_dir must name a folder"):
        open_reader(cache_dir="")


def test_what_the_store_hangs_over_does_not_hold_up_another_shard(open_reader, published, remote):
    reader = open_reader(request_timeout_s=30.0)
    hanging, wanted = first_spans(published)[:2]
    remote.proxy.spoil(hanging.shard, Fault.HANG, FOREVER)
    waiting = threading.Thread(target=read_until_closed, args=(reader, hanging, []))
    waiting.start()
    wait_for(lambda: remote.proxy.spoiled() >= 1)
    assert read_clip(reader, wanted) == published.bytes_of(wanted)
    assert waiting.is_alive()
    reader.close()
    waiting.join(timeout=120)


def test_closing_gives_up_what_hangs_and_ends_the_threads(open_reader, published, remote):
    reader = open_reader(request_timeout_s=30.0)
    remote.proxy.spoil(r"\.tar", Fault.HANG, FOREVER)
    reader.expect(published.spans)
    outcomes = []
    waiting = threading.Thread(target=read_until_closed, args=(reader, published.spans[-1], outcomes))
    waiting.start()
    wait_for(lambda: remote.proxy.spoiled() >= 1)
    reader.close()
    reader.close()
    waiting.join(timeout=120)
    assert len(outcomes) == 1
    assert "closed" in outcomes[0]
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith(("wsm-fetch", "wsm-ahead"))]
