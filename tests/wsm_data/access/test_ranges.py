"""Ranged reads through a store that fails in every way: the same bytes, or an error that names the object."""

import threading
import time

import pytest
from fault_proxy import Fault

from wsm_data.access.ranges import RangeReader
from wsm_data.access.shard_reader import Span
from wsm_data.errors import IntegrityError, StoreError

LASTING = (Fault.WRONG_BYTES, Fault.FORBIDDEN)
PASSING = [fault for fault in Fault if fault not in (*LASTING, Fault.STALE_LISTING, Fault.HANG)]
FOREVER = 10**9


@pytest.fixture
def open_reader(remote, address):
    """Opens readers of the release behind the proxy, and closes them at the end."""
    readers = []

    def open_one(**changes):
        readers.append(RangeReader(address, remote.read(**changes)))
        return readers[-1]

    yield open_one
    for reader in readers:
        reader.close()


def read_clip(reader, span):
    """The bytes of a span, read into three buffers of which one is empty."""
    target = bytearray(span.size)
    view = memoryview(target)
    middle = span.size // 3
    reader.read_into(span.shard, span.offset, [view[:middle], view[middle:middle], view[middle:]])
    return bytes(target)


def test_what_is_read_is_what_is_stored(open_reader, published):
    reader = open_reader()
    assert [read_clip(reader, span) for span in published.spans] == [
        published.bytes_of(span) for span in published.spans
    ]


def test_what_was_announced_is_the_same(open_reader, published):
    reader = open_reader()
    reader.expect(published.spans)
    assert [read_clip(reader, span) for span in published.spans] == [
        published.bytes_of(span) for span in published.spans
    ]


def test_neighbours_that_were_announced_come_with_one_request(open_reader, published, remote):
    reader = open_reader()
    shard = published.spans[0].shard
    spans = [span for span in published.spans if span.shard == shard]
    reader.expect(spans)
    for span in spans:
        assert read_clip(reader, span) == published.bytes_of(span)
    assert len(spans) > 1
    assert [passed.range for passed in remote.proxy.requests(shard)] == [f"bytes=0-{spans[-1].end - 1}"]


def test_a_stretch_may_be_read_in_pieces(open_reader, published, remote):
    reader = open_reader()
    span = published.spans[3]
    reader.expect([span])
    middle = span.offset + span.size // 2
    pieces = [Span(span.shard, span.offset, 10), Span(span.shard, middle, span.end - middle)]
    assert [read_clip(reader, piece) for piece in pieces] == [published.bytes_of(piece) for piece in pieces]
    assert len(remote.proxy.requests(span.shard)) == 1


@pytest.mark.parametrize("is_announced", [True, False])
@pytest.mark.parametrize(
    "faults", [PASSING, *(pytest.param([fault] * 3, marks=pytest.mark.slow) for fault in PASSING)], ids=" ".join
)
def test_faults_that_pass_change_nothing(open_reader, published, remote, faults, is_announced):
    reader = open_reader(attempts=len(PASSING) + 1)
    for fault in faults:
        remote.proxy.spoil(r"\.tar", fault)
    spans = published.spans[::3]
    if is_announced:
        reader.expect(spans)
    assert [read_clip(reader, span) for span in spans] == [published.bytes_of(span) for span in spans]
    assert remote.proxy.spoiled() == len(faults)


def test_a_hanging_server_is_given_up_and_asked_again(open_reader, published, remote):
    reader = open_reader(request_timeout_s=0.3)
    span = published.spans[0]
    remote.proxy.spoil(span.shard, Fault.HANG)
    reader.expect([span])
    assert read_clip(reader, span) == published.bytes_of(span)


@pytest.mark.parametrize("is_announced", [True, False])
@pytest.mark.parametrize(
    "fault",
    [
        Fault.RESET,
        Fault.HANG,
        *(
            pytest.param(fault, marks=pytest.mark.slow)
            for fault in PASSING
            if fault not in (Fault.RESET, Fault.TRICKLE)
        ),
    ],
)
def test_a_fault_that_lasts_is_an_error_that_names_object_attempts_and_cause(
    open_reader, published, remote, address, fault, is_announced
):
    reader = open_reader(attempts=3, request_timeout_s=0.5 if fault is Fault.HANG else 10.0)
    span = published.spans[7]
    remote.proxy.spoil(span.shard, fault, FOREVER)
    if is_announced:
        reader.expect([span])
    with pytest.raises(StoreError, match=rf"{address}/{span.shard}: no answer in 3 attempts, at last because of \w+"):
        read_clip(reader, span)
    if fault is Fault.HANG:  # connecting counts against the time limit too
        assert remote.proxy.spoiled() <= 3
    else:  # aiohttp asks twice within an attempt where a connection was reset
        assert remote.proxy.spoiled() == (6 if fault is Fault.RESET else 3)


def test_a_refusal_is_not_asked_again(open_reader, published, remote):
    reader = open_reader()
    remote.proxy.spoil(published.spans[0].shard, Fault.FORBIDDEN, FOREVER)
    with pytest.raises(
        StoreError, match=f"{published.spans[0].shard}: the store refuses .*(PermissionError|Forbidden)"
    ):
        read_clip(reader, published.spans[0])
    assert remote.proxy.spoiled() == 1


@pytest.mark.parametrize("is_announced", [True, False])
def test_a_shard_that_is_missing_is_named(open_reader, is_announced):
    reader, span = open_reader(), Span("train-999999.tar", 0, 100)
    if is_announced:
        reader.expect([span])
    with pytest.raises(IntegrityError, match=r"train-999999\.tar is missing from \w+://"):
        read_clip(reader, span)


@pytest.mark.parametrize("begin", [-50, 0, 5000])
def test_a_stretch_that_leaves_the_shard_is_not_read(open_reader, published, begin):
    shard = published.manifest.shards[0]
    with pytest.raises(IntegrityError, match=f"{shard.name} .*ends at byte {shard.bytes}"):
        read_clip(open_reader(), Span(shard.name, shard.bytes + begin, 100))


def test_the_failure_of_one_stretch_leaves_the_others(open_reader, published, remote):
    reader = open_reader(attempts=2)
    bad = published.spans[0].shard
    remote.proxy.spoil(bad, Fault.SLOW_DOWN, FOREVER)
    reader.expect(published.spans)
    for span in published.spans:
        if span.shard == bad:
            with pytest.raises(StoreError, match=bad):
                read_clip(reader, span)
        else:
            assert read_clip(reader, span) == published.bytes_of(span)


def test_what_was_announced_is_asked_for_side_by_side(open_reader, published, remote):
    together = threading.Barrier(3)
    remote.proxy.on_request = lambda path: together.wait(timeout=60)  # breaks, unless three are underway at once
    reader = open_reader(fetch_threads=3)
    separate = [spans_of_shard(published, shard.name)[0] for shard in published.manifest.shards][:3]
    reader.expect(separate)
    assert [read_clip(reader, span) for span in separate] == [published.bytes_of(span) for span in separate]
    assert not together.broken


def test_no_more_is_fetched_ahead_than_the_limit(open_reader, published, remote, monkeypatch):
    separate = [spans_of_shard(published, shard.name)[0] for shard in published.manifest.shards]
    limit = separate[0].size + separate[1].size
    monkeypatch.setattr("wsm_data.access.ranges._AHEAD_BYTES_PER_THREAD", limit // 4)
    reader = open_reader(fetch_threads=4)
    reader.expect(separate)
    wait_for(lambda: len(remote.proxy.requests(r"\.tar")) == 2)
    time.sleep(0.1)
    assert len(remote.proxy.requests(r"\.tar")) == 2
    assert [read_clip(reader, span) for span in separate] == [published.bytes_of(span) for span in separate]


def test_what_was_announced_and_never_read_does_not_block_what_follows(open_reader, published, remote, monkeypatch):
    monkeypatch.setattr("wsm_data.access.ranges._AHEAD_BYTES_PER_THREAD", 20_000)
    reader = open_reader(fetch_threads=4)
    reader.expect(published.spans[:1])
    for _ in range(6):
        assert read_clip(reader, published.spans[-1]) == published.bytes_of(published.spans[-1])
    before = len(remote.proxy.requests(r"\.tar"))
    reader.expect(published.spans[10:11])
    wait_for(lambda: len(remote.proxy.requests(r"\.tar")) == before + 1)


def test_many_threads_read_the_same_bytes(open_reader, published, remote):
    reader, found = open_reader(), {}
    remote.proxy.spoil(r"\.tar", Fault.SLOW_DOWN, 3)
    remote.proxy.spoil(r"\.tar", Fault.CUT_BODY, 3)
    reader.expect(published.spans)

    def read_some(first):
        for number in range(first, len(published.spans), 4):
            found[number] = read_clip(reader, published.spans[number])

    threads = [threading.Thread(target=read_some, args=(first,)) for first in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert [found[number] for number in range(len(published.spans))] == [
        published.bytes_of(span) for span in published.spans
    ]


def test_closing_gives_up_what_hangs_and_ends_the_threads(open_reader, published, remote):
    before = threading.active_count()
    reader = open_reader(request_timeout_s=30.0)
    remote.proxy.spoil(r"\.tar", Fault.HANG, FOREVER)
    reader.expect(published.spans)
    wait_for(lambda: remote.proxy.spoiled() > 0)
    reader.close()
    reader.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("wsm-fetch")], before


def test_reading_again_asks_the_store_again(open_reader, published, remote):
    reader, span = open_reader(), published.spans[2]
    remote.proxy.spoil(span.shard, Fault.WRONG_BYTES)
    reader.expect([span])
    assert read_clip(reader, span) != published.bytes_of(span)
    reader.forget(span.shard)
    assert read_clip(reader, span) == published.bytes_of(span)


def test_without_credentials_the_message_says_so(remote, published, monkeypatch):
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.delenv(name)
    reader = RangeReader(remote.url, remote.read())
    with pytest.raises(StoreError, match=r"the store refuses .*[Cc]redentials"):
        read_clip(reader, published.spans[0])
    reader.close()


def test_a_server_that_is_not_there_is_asked_again_and_named(remote, published, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")  # nobody listens on the port of "discard"
    reader = RangeReader(remote.url, remote.read(attempts=2))
    with pytest.raises(StoreError, match=r"no answer in 2 attempts.*Could not connect"):
        read_clip(reader, published.spans[0])
    reader.close()


def spans_of_shard(published, shard):
    return [span for span in published.spans if span.shard == shard]


def wait_for(condition, seconds=20.0):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)
