"""Stretches of shards behind a URL, fetched by ranged requests before they are needed."""

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from wsm_data.access.announcements import Announcements
from wsm_data.access.config import AccessConfig
from wsm_data.access.shard_reader import Span, missing_shard, short_shard
from wsm_data.errors import ConfigError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.retries import RequestConfig

_MERGED_BYTES = 8 << 20  # a request this large costs little more than its transfer
_AHEAD_BYTES_PER_THREAD = 16 << 20


def open_remote_store(root: str, config: AccessConfig) -> FsspecStore:
    """A connection of its own to the release at `root`, asked as a loader's settings say.

    Raises:
        ConfigError: fsspec does not know such URLs, or the settings of requests contradict themselves.
    """
    try:
        request = RequestConfig(
            attempts=config.attempts,
            first_backoff_s=config.first_backoff_s,
            timeout_s=config.request_timeout_s,
            connections=config.fetch_threads,
        )
    except ValueError as error:
        raise ConfigError(f"the settings of a loader's reading must hold: {error}") from error
    return FsspecStore(root, request)


def scatter(data: memoryview, buffers: Sequence[memoryview]) -> None:
    """Copy `data` into buffers, one after the other; together they are as long as it."""
    position = 0
    for buffer in buffers:
        buffer[:] = data[position : position + len(buffer)]
        position += len(buffer)


def read_exactly(store: FsspecStore, span: Span) -> memoryview:
    """The bytes of a stretch.

    Raises:
        IntegrityError: the shard is missing from the store, or ends before the stretch does.
        StoreError: the store refuses, or failed in all attempts.
    """
    try:
        data = store.read_range(span.shard, span.offset, span.size)
    except FileNotFoundError as error:
        raise missing_shard(store.root, span.shard) from error
    if len(data) != span.size:  # the store has made sure that the shard ends there
        raise short_shard(store.root, span, store.size_bytes(span.shard))
    return memoryview(data)


@dataclass(eq=False)
class _Fetch:
    """One request in advance, for one announced span or several that touch.

    Attributes:
        whole: what is asked for.
        unread: spans of it that were not read yet.
        body: the answer, once the request has been handed to a thread.
        read_bytes: bytes that the reader had delivered at that time.
    """

    whole: Span
    unread: set[Span]
    body: Future[memoryview] | None = None
    read_bytes: int = 0


class RangeReader:
    """A `ShardReader` that asks the store for stretches.

    What was announced is asked for by `fetch_threads` threads, in its order, as long as the answers that were not read
    yet stay below 16 MiB a thread. A stretch that was not announced, or whose turn has not come, is asked for by the
    thread that reads it. Answers that nobody fetched while twice as much was read are given up: those who announced
    them have gone another way.
    """

    def __init__(self, root: str, config: AccessConfig):
        """Connect to the release at the URL `root`.

        Raises:
            ConfigError: fsspec does not know such URLs, or the settings of requests contradict themselves.
        """
        self._store = open_remote_store(root, config)
        self._threads = ThreadPoolExecutor(config.fetch_threads, thread_name_prefix="wsm-fetch")
        self._ahead_bytes = _AHEAD_BYTES_PER_THREAD * config.fetch_threads
        self._lock = threading.Lock()
        self._queue: deque[_Fetch] = deque()
        self._begun: list[_Fetch] = []
        self._announced: Announcements[_Fetch] = Announcements()
        self._read_bytes = 0

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        """Fill writable byte buffers, one after the other, with the shard's bytes from `offset` on.

        Raises:
            IntegrityError: the shard is missing, or ends before the last buffer is full; names the shard.
            StoreError: the store refuses, or failed in all attempts; names the object.
        """
        piece = Span(shard, offset, sum(len(buffer) for buffer in buffers))
        with self._lock:
            self._read_bytes += piece.size
            span, fetch = self._announced.find(piece) or (piece, None)
            body = fetch.body if fetch else None
            if fetch and not body and piece.end == span.end:
                self._strike(span, fetch)  # its turn has not come: this thread asks at once
        if fetch is None or body is None:
            scatter(read_exactly(self._store, piece), buffers)
            return
        is_read = False
        try:
            begin = piece.offset - fetch.whole.offset
            scatter(body.result()[begin : begin + piece.size], buffers)
            is_read = piece.end < span.end
        finally:
            if not is_read:  # to its end, or it cannot be read at all
                with self._lock:
                    self._strike(span, fetch)

    def expect(self, spans: Sequence[Span]) -> None:
        """Say what will be read next, in this order."""
        with self._lock:
            for group in _touching(self._announced.unknown(spans)):
                whole = Span(group[0].shard, group[0].offset, group[-1].end - group[0].offset)
                fetch = _Fetch(whole, unread=set(group))
                self._queue.append(fetch)
                for span in group:
                    self._announced.add(span, fetch)
            self._give_up_abandoned()
            self._begin()

    def forget(self, shard: str) -> None:
        """Nothing: of what was read nothing is kept, the next reading asks the store."""

    def close(self) -> None:
        """Give up what is being fetched, and end the threads."""
        with self._lock:
            self._queue.clear()
        self._store.close()
        self._threads.shutdown()

    def _strike(self, span: Span, fetch: _Fetch) -> None:
        """A span needs its request no longer."""
        self._announced.remove(span)
        fetch.unread.discard(span)
        if not fetch.unread:
            for requests in (self._queue, self._begun):
                if fetch in requests:
                    requests.remove(fetch)
        self._begin()

    def _begin(self) -> None:
        """Hand requests to the threads while their answers have room."""
        held_bytes = sum(fetch.whole.size for fetch in self._begun)
        while self._queue and (not self._begun or held_bytes + self._queue[0].whole.size <= self._ahead_bytes):
            fetch = self._queue.popleft()
            fetch.read_bytes = self._read_bytes
            fetch.body = self._threads.submit(read_exactly, self._store, fetch.whole)
            self._begun.append(fetch)
            held_bytes += fetch.whole.size

    def _give_up_abandoned(self) -> None:
        oldest = self._read_bytes - 2 * self._ahead_bytes
        for fetch in [fetch for fetch in self._begun if fetch.read_bytes < oldest]:
            for span in tuple(fetch.unread):
                self._strike(span, fetch)


def _touching(spans: Sequence[Span]) -> Iterator[list[Span]]:
    """Group spans that follow one another without a gap, up to the size of a merged request."""
    group: list[Span] = []
    for span in spans:
        touches = group and (span.shard, span.offset) == (group[-1].shard, group[-1].end)
        if group and not (touches and span.end - group[0].offset <= _MERGED_BYTES):
            yield group
            group = []
        group.append(span)
    if group:
        yield group
