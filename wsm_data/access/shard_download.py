"""A whole shard from a store: in parts side by side, and with the sha256 of the manifest."""

import hashlib
import logging
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import BinaryIO

from wsm_data.access.ranges import read_exactly
from wsm_data.access.shard_reader import Span
from wsm_data.errors import IntegrityError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.shards.manifest import ShardInfo

_LOGGER = logging.getLogger(__name__)
_PART_BYTES = 4 << 20
_TRIES = 2  # a body may be damaged on the way, or an old copy; the same twice is the store's


def download(shard: ShardInfo, store: FsspecStore, file: BinaryIO, threads: int) -> None:
    """Write a shard into a file; each of the threads holds one part of it in memory.

    Raises:
        IntegrityError: the shard is missing or too short, or has another sha256 than in the manifest, twice.
        StoreError: the store refuses, or failed in all attempts.
    """
    for _ in range(_TRIES):
        digest = hashlib.sha256()
        file.seek(0)
        for part in _parts(shard, store, threads):
            digest.update(part)
            file.write(part)
        file.flush()
        if digest.hexdigest() == shard.sha256:
            return
        _LOGGER.warning("%s/%s was downloaded with a wrong sha256", store.root, shard.name)
    raise IntegrityError(
        f"{store.root}/{shard.name} must have sha256 {shard.sha256}, found {digest.hexdigest()} in the last of "
        f"{_TRIES} downloads; upload the shard again, or run `wsm verify` for the extent of the damage"
    )


def _parts(shard: ShardInfo, store: FsspecStore, threads: int) -> Iterator[memoryview]:
    """The parts of a shard in order; the next ones are on their way while one is used."""
    underway: deque[Future[memoryview]] = deque()
    with ThreadPoolExecutor(threads, thread_name_prefix="wsm-fetch") as pool:
        for offset in range(0, shard.bytes, _PART_BYTES):
            span = Span(shard.name, offset, min(_PART_BYTES, shard.bytes - offset))
            underway.append(pool.submit(read_exactly, store, span))
            if len(underway) == threads:
                yield underway.popleft().result()
        while underway:
            yield underway.popleft().result()
