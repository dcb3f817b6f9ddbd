"""Shards behind a URL, read from a local cache into which they are fetched whole, in advance where that is possible."""

import logging
import threading
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path

from wsm_data.access.announcements import Announcements
from wsm_data.access.config import AccessConfig
from wsm_data.access.local_shards import read_scattered
from wsm_data.access.ranges import open_remote_store
from wsm_data.access.shard_cache import ShardCache
from wsm_data.access.shard_download import download
from wsm_data.access.shard_reader import Span, missing_shard, short_shard
from wsm_data.errors import ConfigError, StoreError, WsmError
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo, release_digest

_LOGGER = logging.getLogger(__name__)
_GIB = 1 << 30
_POLL_S = 0.02
_IDLE_S = 1.0  # what is wanted is looked for again: another process may have removed it


class CachedShards:
    """A `ShardReader` over a `ShardCache`.

    A shard that is needed now is downloaded by the thread that reads it, or waited for where another thread or process
    is at it. One more thread downloads what was announced, in the order in which it is needed, and no more of it than
    the cache can hold.
    """

    def __init__(self, root: str, manifest: ReleaseManifest, config: AccessConfig):
        """Connect to the release at the URL `root`, and open the cache.

        Raises:
            ConfigError: the cache has no folder, or could not hold the largest shard; fsspec does not know such URLs.
        """
        if not config.cache_dir:
            raise ConfigError(f"cache_dir must name a folder, to read {root} with access = {config.access}; found none")
        self._shards = {shard.name: shard for shard in manifest.shards}
        self._limit_bytes = int(config.cache_gib * _GIB)
        _require_room(manifest.shards, self._limit_bytes)
        self._cache = ShardCache(Path(config.cache_dir), release_digest(manifest), self._limit_bytes)
        self._store = open_remote_store(root, config)
        self._threads = config.fetch_threads
        self._lock = threading.Lock()
        self._announced: Announcements[None] = Announcements()
        self._unreachable: set[str] = set()
        self._closed, self._news = threading.Event(), threading.Event()
        self._ahead = threading.Thread(target=self._fetch_ahead, name="wsm-ahead", daemon=True)
        self._ahead.start()

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        """Fill writable byte buffers, one after the other, with the shard's bytes from `offset` on.

        Raises:
            IntegrityError: the shard is missing from the store, is too short or damaged there, or ends before the last
                buffer is full; names the shard.
            StoreError: the store refuses, or failed in all attempts; names the object.
        """
        info = self._shards.get(shard)
        if info is None:
            raise missing_shard(self._store.root, shard)
        span = Span(shard, offset, sum(len(buffer) for buffer in buffers))
        while not (self._read_present(info, span, buffers) or self._read_downloaded(info, span, buffers)):
            if self._closed.wait(_POLL_S):
                raise StoreError(f"{self._store.root}: the reader was closed while {shard} was being read")
        self._strike(span)

    def expect(self, spans: Sequence[Span]) -> None:
        """Say what will be read next, in this order."""
        with self._lock:
            for span in self._announced.unknown(spans):
                self._announced.add(span, None)
        self._news.set()

    def forget(self, shard: str) -> None:
        """Remove the shard from the cache: the next reading downloads it again."""
        self._cache.remove(self._shards[shard])

    def close(self) -> None:
        """Give up what is being downloaded, and end the thread."""
        self._closed.set()
        self._news.set()
        self._store.close()
        self._ahead.join()

    def _read_present(self, shard: ShardInfo, span: Span, buffers: Sequence[memoryview]) -> bool:
        """Read from the cache; False where it does not have the shard."""
        with self._cache.opened(shard) as file:
            if file is not None:
                self._read_from(file.fileno(), span, buffers)
            return file is not None

    def _read_downloaded(self, shard: ShardInfo, span: Span, buffers: Sequence[memoryview]) -> bool:
        """Download the shard and read it before others may remove it; False where it cannot be downloaded now.

        Threads do not queue here: what a store hangs over, and is needed later, must not hold up what is needed now.
        """
        with self._cache.reserved(shard) as file:
            if file is not None:
                download(shard, self._store, file, self._threads)
                self._read_from(file.fileno(), span, buffers)
                self._unreachable.discard(shard.name)
            return file is not None

    def _read_from(self, descriptor: int, span: Span, buffers: Sequence[memoryview]) -> None:
        if read_scattered(descriptor, span.offset, buffers) < span.size:
            raise short_shard(self._store.root, span, self._shards[span.shard].bytes)

    def _strike(self, piece: Span) -> None:
        """A stretch was read; when it is the last that was announced of its shard, another shard may be fetched."""
        with self._lock:
            found = self._announced.find(piece)
            if found is not None and found[0].end == piece.end:
                self._announced.remove(found[0])
                if piece.shard not in self._announced.shards():
                    self._news.set()

    def _fetch_ahead(self) -> None:
        """Download what is announced, until the reader is closed; what is wanted may change with each download."""
        while not self._closed.is_set():
            self._news.clear()
            if not any(self._is_fetched(shard) for shard in self._wanted()):
                self._news.wait(_IDLE_S)

    def _wanted(self) -> list[ShardInfo]:
        """The announced shards, those that are needed first, as many as the cache can hold."""
        with self._lock:
            shards = [self._shards[name] for name in self._announced.shards() if name in self._shards]
        held_bytes = accumulate(shard.bytes for shard in shards)
        return [shard for shard, total in zip(shards, held_bytes, strict=True) if total <= self._limit_bytes]

    def _is_fetched(self, shard: ShardInfo) -> bool:
        """Download a shard in advance, where that is possible; whether it was downloaded."""
        if shard.name in self._unreachable or self._cache.has(shard):
            return False
        try:
            return self._read_downloaded(shard, Span(shard.name, 0, 0), ())
        except (WsmError, OSError) as error:
            self._unreachable.add(shard.name)
            if not self._closed.is_set():
                place = f"{self._store.root}/{shard.name}"
                _LOGGER.warning("%s could not be fetched in advance, and is tried when it is read: %s", place, error)
            return False


def _require_room(shards: Sequence[ShardInfo], limit_bytes: int) -> None:
    largest = max(shards, key=lambda shard: shard.bytes, default=None)
    if largest is not None and largest.bytes > limit_bytes:
        raise ConfigError(
            f"cache_gib must be at least {largest.bytes / _GIB:.6f} to hold {largest.name} of {largest.bytes} "
            f"bytes, found {limit_bytes / _GIB:.6f}; to fetch ahead it must hold several shards"
        )
