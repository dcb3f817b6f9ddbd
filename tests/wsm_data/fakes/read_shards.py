"""A process that reads stretches through the cache: `read_shards.py URL CACHE_DIR CACHE_BYTES < SPANS > DIGESTS`."""

import hashlib
import json
import sys

from wsm_data.access import shard_download
from wsm_data.access.cached_shards import CachedShards
from wsm_data.access.config import AccessConfig
from wsm_data.access.release import read_manifest
from wsm_data.access.shard_reader import Span
from wsm_data.files.stores import open_store

PART_BYTES = 50_000


def main(url: str, cache_dir: str, cache_bytes: str) -> None:
    shard_download._PART_BYTES = PART_BYTES  # so that a small shard comes in many parts
    spans = [Span(*span) for span in json.load(sys.stdin)]
    gib = float(cache_bytes) / 2**30
    config = AccessConfig(cache_dir=cache_dir, cache_gib=gib, fetch_threads=2, first_backoff_s=0.01)
    reader = CachedShards(url, read_manifest(open_store(url)), config)
    reader.expect(spans)
    for span in spans:
        target = bytearray(span.size)
        reader.read_into(span.shard, span.offset, [memoryview(target)])
        sys.stdout.write(hashlib.sha256(target).hexdigest() + "\n")
    reader.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
