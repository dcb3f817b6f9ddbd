"""A whole shard from a store into the cache: in parts side by side, hashed on the way."""

import hashlib
import logging
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor, Future

from wsm_data.access.ranges import read_exactly
from wsm_data.access.shard_cache import CachedShard, Download
from wsm_data.access.shard_reader import Span
from wsm_data.errors import IntegrityError
from wsm_data.files.fsspec_store import FsspecStore

_LOGGER = logging.getLogger(__name__)

_PART_BYTES = 4 << 20
_TRIES = (
    2  # a body may be damaged on the way, or come from a copy that is not up to date; the same twice is the store's
)


def fill(shard: CachedShard, download: Download, store: FsspecStore, threads: Executor, side_by_side: int) -> None:
    """Download a shard and finish it.

    Args:
        shard: what is downloaded.
        download: room for it.
        store: the release.
        threads: where parts are asked for.
        side_by_side: parts that are asked for at the same time; as many are held in memory.

    Raises:
        IntegrityError: the shard is missing or too short, or has another sha256 than in the manifest, twice.
        StoreError: the store refuses, or failed in all attempts.
    """
    for attempt in range(_TRIES):
        download.restart()
        digest = hashlib.sha256()
        for part in _parts(shard, store, threads, side_by_side):
            digest.update(part)
            download.write(part)
        if digest.hexdigest() == shard.sha256:
            download.finish()
            return
        _LOGGER.warning("%s/%s: download %d has a wrong sha256", store.root, shard.name, attempt + 1)
    raise IntegrityError(
        f"{store.root}/{shard.name} must have sha256 {shard.sha256}, found {digest.hexdigest()} in the last of "
        f"{_TRIES} downloads; upload the shard again, or run `wsm verify` for the extent of the damage"
    )


def _parts(shard: CachedShard, store: FsspecStore, threads: Executor, side_by_side: int) -> Iterator[memoryview]:
    """The parts of a shard in order; the next ones are on their way while one is used."""
    spans = (
        Span(shard.name, offset, min(_PART_BYTES, shard.bytes - offset))
        for offset in range(0, shard.bytes, _PART_BYTES)
    )
    underway: deque[Future[memoryview]] = deque()
    try:
        for span in spans:
            underway.append(threads.submit(read_exactly, store, span))
            if len(underway) >= side_by_side:
                yield underway.popleft().result()
        while underway:
            yield underway.popleft().result()
    finally:
        for future in underway:
            future.cancel()
