"""The loader doctor: the real loader run for a while on the user's release with the user's settings, and measured."""

import time
from collections.abc import Generator, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from wsm_data.access.local_shards import LocalShards
from wsm_data.access.ranges import open_remote_store, read_exactly
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.stores import LocalStore
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.config import LoaderConfig, ReadConfig
from wsm_data.loaders.doctor.diagnosis import LoaderRun, SourceFacts
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.reading.clip_places import READ_MEMBERS, RGB_MEMBERS, ClipPlace, clip_places, span_of
from wsm_data.loaders.reading.clip_reads import POSE_BYTES
from wsm_data.loaders.sources.clips import Sources, SourceTable
from wsm_data.schema.sequence import POSE_SLOTS

_STORED_ITEM_BYTES = 2  # latents are stored as float16
LIMIT_BYTES, LIMIT_S = 1 << 29, 2.0
"""How much is read again for the limit, and for how long, at most."""


def examine(
    config: LoaderConfig, *, batches: int, seconds: float, step_s: float = 0.0, ranks: int = 1
) -> tuple[LoaderRun, SourceFacts]:
    """Run a loader until it has delivered so many batches or so much time has passed, epoch after epoch.

    Nothing is recorded in a ledger. The limit is measured at the end, with clips that were delivered.

    Args:
        config: the settings.
        batches: batches to take behind the first one, at most.
        seconds: when to stop, s.
        step_s: time to rest after each batch, as a training step would take, s.
        ranks: number of ranks of the training run; what rank 0 of them does is measured.

    Raises:
        ConfigError: the settings are wrong, or the ranks cannot share a step.
        IntegrityError: the release is damaged.
        StoreError: a store failed for good.
    """
    start = time.perf_counter()
    with ClipLoader(replace(config, ledger=""), rank=0, world_size=ranks) as loader:
        stream = _endless(loader)
        refs = [next(stream).refs]
        first_batch_s = time.perf_counter() - start
        before, start = loader.timing.seconds(), time.perf_counter()
        stored_bytes = 0
        while len(refs) <= batches and time.perf_counter() - start < seconds:
            batch = next(stream)
            refs.append(batch.refs)
            stored_bytes += _stored_bytes(batch)
            del batch  # its memory is used again
            time.sleep(step_s)
        elapsed_s, after = time.perf_counter() - start, loader.timing.seconds()
        stream.close()
        members = READ_MEMBERS if config.depth else RGB_MEMBERS
        places = clip_places(loader.sources, np.concatenate(refs), members)
        run = LoaderRun(
            clips=len(places) - len(refs[0]),
            stored_bytes=stored_bytes,
            elapsed_s=elapsed_s,
            first_batch_s=first_batch_s,
            seconds={part: after[part] - before[part] for part in after},
            step_s=step_s,
            limit_bytes_per_s=_read_rate(loader.sources, places, config.read),
            remote=any(map(_is_remote, loader.sources.tables)),
        )
        return run, source_facts(loader)


def source_facts(loader: ClipLoader) -> SourceFacts:
    """Count shards, their bytes, and the padding of the loader's epoch."""
    tables = loader.sources.tables
    return SourceFacts(
        shards=sum(len(_shards(table)) for table in tables),
        shard_bytes=sum(sum(_shards(table).values()) for table in tables),
        padding_share=loader.summary.padding_share,
        longest_latents=int(loader.epoch_order.sequence_latents.max()),
        remote=any(map(_is_remote, tables)),
    )


def _endless(loader: ClipLoader) -> Generator[Batch, None, None]:
    while True:
        yield from loader


def _is_remote(table: SourceTable) -> bool:
    return not isinstance(table.release.store, LocalStore)


def _shards(table: SourceTable) -> dict[str, int]:
    """Bytes of each shard that holds clips of a source."""
    wanted = {table.shards[code] for code in np.unique(table.shard_codes)}
    return {shard.name: shard.bytes for shard in table.release.manifest.shards if shard.name in wanted}


def _stored_bytes(batch: Batch) -> int:
    """Bytes that the latents and poses of a batch take in the shards."""
    channels, height, width = batch.rgb.shape[2:]
    of_cells = channels * _STORED_ITEM_BYTES * height * width
    if batch.depth is not None:
        of_cells += (channels * _STORED_ITEM_BYTES + 1) * height * width
    return sum(span.length for span in batch.spans) * (of_cells + POSE_SLOTS * POSE_BYTES)


def _read_rate(sources: Sources, places: Sequence[ClipPlace], read: ReadConfig) -> float:
    """Bytes per second at which clips are read again, one after the other into one buffer: one stream, one thread."""
    spans = [(place.source, span_of(place)) for place in places]
    buffer = memoryview(bytearray(max(span.size for _, span in spans)))
    with ExitStack() as opened:
        shards = [_open_shards(table, read) for table in sources.tables]
        for one in shards:
            opened.callback(one.close)
        total, start = 0, time.perf_counter()
        for source, span in spans:
            one = shards[source]
            if isinstance(one, LocalShards):
                one.read_into(span.shard, span.offset, [buffer[: span.size]])
            else:
                read_exactly(one, span)
            total += span.size
            if total > LIMIT_BYTES or time.perf_counter() - start > LIMIT_S:
                break
        return total / (time.perf_counter() - start)


def _open_shards(table: SourceTable, read: ReadConfig) -> LocalShards | FsspecStore:
    root = table.release.store.root
    return open_remote_store(root, read) if _is_remote(table) else LocalShards(root)
