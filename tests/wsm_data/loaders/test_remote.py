"""Ranged reads through a store that fails in every way: the same bytes, or an error that names the object."""

import pytest
from fault_proxy import Fault

from wsm_data.errors import IntegrityError, StoreError
from wsm_data.loaders.remote import RangeReader
from wsm_data.loaders.shard_reader import Span

PASSING = [fault for fault in Fault if fault not in (Fault.WRONG_BYTES, Fault.STALE_LISTING, Fault.HANG)]


@pytest.fixture
def open_reader(remote):
    """Opens readers of the release behind the proxy, and closes them at the end."""
    readers = []

    def open_one(**changes):
        readers.append(RangeReader(remote.url, remote.read(**changes)))
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


@pytest.mark.parametrize("fault", PASSING)
@pytest.mark.parametrize("is_announced", [True, False])
def test_faults_that_pass_change_nothing(open_reader, published, remote, fault, is_announced):
    reader = open_reader()
    remote.proxy.spoil(r"\.tar", fault, times=3)
    spans = published.spans[::5]
    if is_announced:
        reader.expect(spans)
    assert [read_clip(reader, span) for span in spans] == [published.bytes_of(span) for span in spans]
    assert remote.proxy.spoiled() == 3
