"""One step of one rank: its clips read into one block of memory, and described."""

from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

import numpy as np

from wsm_data.access.local_shards import LocalShards
from wsm_data.access.open_shards import open_shards
from wsm_data.access.shard_reader import ShardReader, Span
from wsm_data.loaders.batches.batch import BatchBlock
from wsm_data.loaders.batches.buffers import BufferPool, allocator
from wsm_data.loaders.batches.filling import BatchSequence, batch_layout, describe, sequences_of_rows
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.order.epoch_order import EpochOrder
from wsm_data.loaders.reading.clip_filler import ClipFiller
from wsm_data.loaders.reading.clip_places import READ_MEMBERS, RGB_MEMBERS, clip_places, span_of
from wsm_data.loaders.sources.clips import Sources
from wsm_data.loaders.timing import Part, Timing

Delivered = TypeVar("Delivered")


class StepReader:
    """Reads steps of one rank. Safe to be used by several threads; what it delivers does not depend on them."""

    def __init__(
        self, sources: Sources, read: ReadConfig, timing: Timing, *, rank: int, world_size: int, depth: bool = True
    ):
        """Open the shards.

        Args:
            sources: the clips.
            read: the settings.
            timing: adds up the time of all parts.
            rank: number of this rank.
            world_size: number of ranks.
            depth: whether batches have depth.

        Raises:
            ConfigError: a dtype that latents cannot have, no statistics to standardise by, a place without a reader.
        """
        self._sources, self._timing, self._rank, self._world_size = sources, timing, rank, world_size
        self._pool = BufferPool(blocks=max(read.prefetch_batches, 1) + 1, allocate=allocator(pinned=read.pin_memory))
        self.readers = _open_readers(sources, read)
        self._filler = ClipFiller(sources, read, self.readers, timing, depth=depth)
        self._depth, self._members = depth, READ_MEMBERS if depth else RGB_MEMBERS

    @property
    def asks_stores(self) -> bool:
        """Whether anything is read from behind a URL, so that reading may have to wait for a store."""
        return not all(isinstance(reader, LocalShards) for reader in self.readers)

    def announce(self, epoch_order: EpochOrder, step: int) -> None:
        """Tell the readers what a step will need, before it is read."""
        if not self.asks_stores:
            return
        spans: dict[ShardReader, list[Span]] = {}
        for place in clip_places(self._sources, np.concatenate(self._rows(epoch_order, step)), self._members):
            spans.setdefault(self.readers[place.source], []).append(span_of(place))
        for reader, coming in spans.items():
            reader.expect(coming)

    def begin(
        self, epoch_order: EpochOrder, step: int, finish: Callable[[BatchBlock], Delivered]
    ) -> "StepWork[Delivered]":
        """Lay out what this rank has of a step, in memory that is taken for it.

        Args:
            epoch_order: which clips make up the step.
            step: the step.
            finish: makes of the batch what is delivered; called in the thread that completes it.
        """
        with self._timing.measure(Part.COLLATE):
            rows = self._rows(epoch_order, step)
            refs = np.concatenate(rows)
            clips = sequences_of_rows(rows, clip_places(self._sources, refs, self._members), epoch_order)
            shape, dtype = self._filler.latent_shape, self._filler.dtype
            layout = batch_layout(clips, len(rows), epoch_order, shape, dtype, depth=self._depth)
            block = BatchBlock(
                memory=self._pool.take(layout.size_bytes),
                layout=layout,
                spans=tuple(clip.span for clip in clips),
                refs=refs,
                keys=tuple(clip.place.key for clip in clips),
                epoch=epoch_order.epoch,
                step=step,
            )
        return StepWork(block, clips, self._filler, finish, self._timing)

    def close(self) -> None:
        """Give back files, threads and connections."""
        for reader in self.readers:
            reader.close()

    def _rows(self, epoch_order: EpochOrder, step: int) -> list[np.ndarray]:
        return epoch_order.rows(step, self._rank, self._world_size)


class StepWork(Generic[Delivered]):
    """What one rank has of a step, read clip by clip, in any order and by several threads at the same time."""

    def __init__(
        self,
        block: BatchBlock,
        clips: Sequence[BatchSequence],
        filler: ClipFiller,
        finish: Callable[[BatchBlock], Delivered],
        timing: Timing,
    ):
        """Read nothing yet; the arguments are those of `StepReader.begin` and what it laid out."""
        self._block, self._clips, self._filler, self._finish, self._timing = block, clips, filler, finish, timing
        self._goals: list[np.ndarray | None] = [None] * len(clips)

    @property
    def parts(self) -> int:
        """Clips."""
        return len(self._clips)

    def make(self, part: int) -> None:
        """Read a clip; errors are those of `ClipFiller.fill`."""
        self._goals[part] = self._filler.fill(self._block, self._clips[part])

    def complete(self) -> Delivered:
        """Describe what was read; the batch is whole then, and is made what is delivered."""
        with self._timing.measure(Part.COLLATE):
            describe(self._block, self._clips, [goal for goal in self._goals if goal is not None])
        with self._timing.measure(Part.TRANSFER):
            return self._finish(self._block)


def _open_readers(sources: Sources, read: ReadConfig) -> Sequence[ShardReader]:
    """A reader for each source; sources of one release share it."""
    by_root: dict[str, ShardReader] = {}
    for table in sources.tables:
        release = table.release
        if release.store.root not in by_root:
            by_root[release.store.root] = open_shards(release.store, release.manifest, read)
    return [by_root[table.release.store.root] for table in sources.tables]
