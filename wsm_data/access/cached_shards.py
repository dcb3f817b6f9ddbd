"""Shards behind a URL, read from a local cache into which they are fetched whole, in advance where that is possible."""

import logging
import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate
from pathlib import Path

from wsm_data.access.announcements import Announcements
from wsm_data.access.config import AccessConfig
from wsm_data.access.local_shards import read_scattered
from wsm_data.access.ranges import open_remote_store
from wsm_data.access.shard_cache import CachedShard, Download, Refusal, ShardCache
from wsm_data.access.shard_download import fill
from wsm_data.access.shard_reader import Span, missing_shard, short_shard
from wsm_data.errors import ConfigError, StoreError, WsmError
from wsm_data.shards.manifest import ReleaseManifest, release_digest

_LOGGER = logging.getLogger(__name__)

_DOWNLOADS_AHEAD = 2  # while one is hashed to its end and brought to disk, the next is on its way
_POLL_S = 0.02
_IDLE_S = 1.0
_RETRY_S = 5.0  # what is wanted is looked for again: it may have been evicted, and being asked for keeps it young
_WASTEFUL = 4  # bytes downloaded for a byte read


class CachedShards:
    """A `ShardReader` over a `ShardCache`.

    A shard that is needed now is downloaded by the thread that reads it, or waited for where another thread or process
    is at it. Threads of the reader download what was announced, in the order in which it is needed, and never so much
    that it would displace what is needed earlier.
    """

    def __init__(self, root: str, manifest: ReleaseManifest, config: AccessConfig):
        """Connect to the release at the URL `root`, and open the cache.

        Raises:
            ConfigError: the cache has no folder, or could not hold the largest shard; fsspec does not know such URLs.
        """
        if not config.cache_dir:
            raise ConfigError(f"cache_dir must name a folder, to read {root} with access = {config.access}; found none")
        digest = release_digest(manifest)
        self._shards = {
            shard.name: CachedShard(digest=digest, name=shard.name, bytes=shard.bytes, sha256=shard.sha256)
            for shard in manifest.shards
        }
        self._limit_bytes = int(config.cache_gib * (1 << 30))
        self._cache = ShardCache(Path(config.cache_dir), self._limit_bytes)
        self._cache.require_room_for(self._shards.values())
        self._store = open_remote_store(root, config)
        self._fetch_threads = config.fetch_threads
        self._parts = ThreadPoolExecutor(config.fetch_threads, thread_name_prefix="wsm-fetch")
        self._closed = threading.Event()
        self._changed = threading.Condition()
        self._announced: Announcements[None] = Announcements()
        self._next_try_s: dict[str, float] = {}
        self._downloads = 0
        self._downloaded_bytes = self._read_bytes = 0
        self._has_warned = False
        self._unreachable: set[str] = set()
        self._ahead = [
            threading.Thread(target=self._fetch_ahead, name=f"wsm-ahead-{number}", daemon=True)
            for number in range(_DOWNLOADS_AHEAD)
        ]
        for thread in self._ahead:
            thread.start()

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        """Fill writable byte buffers, one after the other, with the shard's bytes from `offset` on.

        Raises:
            IntegrityError: the shard is missing from the store, is too short or damaged there, or ends before the last
                buffer is full; names the shard.
            StoreError: the store refuses, or failed in all attempts; names the object.
        """
        cached = self._shards.get(shard)
        if cached is None:
            raise missing_shard(self._store.root, shard)
        span = Span(shard, offset, sum(len(buffer) for buffer in buffers))
        while not (self._read_present(cached, span, buffers) or self._read_downloaded(cached, span, buffers)):
            self._require_open(cached)
            self._closed.wait(_POLL_S)
        with self._changed:
            self._strike(span)

    def expect(self, spans: Sequence[Span]) -> None:
        """Say what will be read next, in this order."""
        with self._changed:
            for span in self._announced.unknown(spans):
                self._announced.add(span, None)
            self._changed.notify_all()

    def forget(self, shard: str) -> None:
        """Remove the shard from the cache: the next reading downloads it again."""
        self._cache.remove(self._shards[shard])

    def close(self) -> None:
        """Give up what is being downloaded, and end the threads."""
        self._closed.set()
        with self._changed:
            self._changed.notify_all()
        self._store.close()
        for thread in self._ahead:
            thread.join()
        with self._changed:
            self._changed.wait_for(lambda: not self._downloads)
        self._parts.shutdown()

    def _read_present(self, shard: CachedShard, span: Span, buffers: Sequence[memoryview]) -> bool:
        """Read from the cache; False where it does not have the shard."""
        with self._cache.opened(shard) as descriptor:
            if descriptor is not None:
                self._read_from(descriptor, span, buffers)
            return descriptor is not None

    def _read_downloaded(self, shard: CachedShard, span: Span, buffers: Sequence[memoryview]) -> bool:
        """Download the shard and read from it; False where another one is at it, or holds the room for it."""
        begun = self._cache.begin(shard, keep=self._wanted(), must=True)
        if isinstance(begun, Refusal):
            return False
        with begun:
            self._download(shard, begun)
            self._read_from(begun.descriptor, span, buffers)
        return True

    def _require_open(self, shard: CachedShard) -> None:
        if self._closed.is_set():
            raise StoreError(f"{self._store.root}: the reader was closed while {shard.name} was being read")

    def _read_from(self, descriptor: int, span: Span, buffers: Sequence[memoryview]) -> None:
        if read_scattered(descriptor, span.offset, buffers) < span.size:
            raise short_shard(self._store.root, span, os.fstat(descriptor).st_size)

    def _download(self, shard: CachedShard, download: Download) -> None:
        with self._changed:
            self._require_open(shard)
            self._downloads += 1
        try:
            fill(shard, download, self._store, self._parts, self._fetch_threads)
        finally:
            with self._changed:
                self._downloads -= 1
                self._changed.notify_all()
        with self._changed:
            self._downloaded_bytes += shard.bytes
            is_waste = self._downloaded_bytes > self._limit_bytes + _WASTEFUL * self._read_bytes
            if is_waste and not self._has_warned:
                self._has_warned = True
                _LOGGER.warning(
                    "%d bytes of shards were downloaded to read %d bytes: the cache of %d bytes is too small for the "
                    "shards that are read in turn, or few clips of each are read. Raise cache_gib, lower "
                    "window_blocks, or set access = ranges",
                    self._downloaded_bytes,
                    self._read_bytes,
                    self._limit_bytes,
                )

    def _strike(self, piece: Span) -> None:
        """A stretch was read; when it is the last that was announced of its shard, another shard may be fetched."""
        self._read_bytes += piece.size
        found = self._announced.find(piece)
        if found is not None and found[0].end == piece.end:
            self._announced.remove(found[0])
            if piece.shard not in self._announced.shards():
                self._next_try_s.pop(piece.shard, None)
                self._changed.notify_all()

    def _wanted(self) -> list[CachedShard]:
        """The announced shards, those that are needed first, as many as the cache can hold."""
        with self._changed:
            shards = [self._shards[name] for name in self._announced.shards() if name in self._shards]
        held_bytes = accumulate(shard.bytes for shard in shards)
        return [shard for shard, total in zip(shards, held_bytes, strict=True) if total <= self._limit_bytes]

    def _fetch_ahead(self) -> None:
        """Download what is announced, until the reader is closed."""
        while not self._closed.is_set():
            with self._changed:
                wanted = self._wanted()
                now_s = time.monotonic()
                shard = next((shard for shard in wanted if self._next_try_s.get(shard.name, 0.0) <= now_s), None)
                if shard is None:
                    self._changed.wait(_IDLE_S)
                    continue
                self._next_try_s[shard.name] = now_s + _RETRY_S
            self._try_ahead(shard, wanted)

    def _try_ahead(self, shard: CachedShard, wanted: Sequence[CachedShard]) -> None:
        try:
            begun = self._cache.begin(shard, keep=wanted, must=False)
            if not isinstance(begun, Refusal):
                with begun:
                    self._download(shard, begun)
        except (WsmError, OSError) as error:
            if not self._closed.is_set():
                self._warn_once(shard.name, error)

    def _warn_once(self, name: str, error: Exception) -> None:
        if name not in self._unreachable:
            self._unreachable.add(name)
            place = f"{self._store.root}/{name}"
            _LOGGER.warning("%s could not be fetched in advance, and will be tried when it is read: %s", place, error)
