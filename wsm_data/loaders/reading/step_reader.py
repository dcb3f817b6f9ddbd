"""One step of one rank: its clips read into one block of memory, checked, standardised, and described."""

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import torch

from wsm_data.access.local_shards import LocalShards
from wsm_data.access.open_shards import open_shards
from wsm_data.access.shard_reader import ShardReader
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import LATENT_DTYPES, LATENT_TENSORS, PackedBatch
from wsm_data.loaders.batches.buffers import BufferPool, allocator
from wsm_data.loaders.batches.filling import ArrangedClip, arrange, batch_layout, describe, slots_of
from wsm_data.loaders.batches.standardise import convert, standardisations
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.order.epoch_order import EpochOrder
from wsm_data.loaders.reading.clip_places import clip_places, span_of
from wsm_data.loaders.reading.clip_reads import read_clip
from wsm_data.loaders.reading.prefetch import done_alone
from wsm_data.loaders.reading.verification import verification_of
from wsm_data.loaders.sources.clips import Sources
from wsm_data.loaders.timing import Part, Stopwatch, total_seconds

_LOG = logging.getLogger(__name__)
_STORED = torch.float16


class StepReader:
    """Reads steps of one rank. Safe to be used by several threads; what it delivers does not depend on them."""

    def __init__(self, sources: Sources, read: ReadConfig, *, rank: int, world_size: int):
        """Open the shards.

        Latents are standardised here for the processor; for another device they stay as they are stored.

        Args:
            sources: the clips.
            read: the settings.
            rank: number of this rank.
            world_size: number of ranks.

        Raises:
            ConfigError: a dtype that latents cannot have, no statistics to standardise by, a place without a reader.
        """
        if read.dtype not in LATENT_DTYPES:
            raise ConfigError(f"dtype must be one of {', '.join(LATENT_DTYPES)}, found {read.dtype!r}")
        manifest = sources.tables[0].release.manifest
        codec = manifest.codec
        cells = (manifest.encoded_height_px // codec.spatial_ratio, manifest.encoded_width_px // codec.spatial_ratio)
        as_stored = torch.device(read.device).type != "cpu"  # not looked for: a forked process must not ask for it
        self._sources, self._read, self._rank, self._world_size = sources, read, rank, world_size
        self._latent_shape = (codec.channels, *cells)
        self._dtype = _STORED if as_stored else LATENT_DTYPES[read.dtype]
        self._standardise = standardisations(manifest) if read.standardise and not as_stored else {}
        if self._standardise and len({table.release.store.root for table in sources.tables}) > 1:
            _LOG.warning("latents of all sources are standardised by the statistics of the first, %s", manifest.name)
        self._converts = self._dtype is not _STORED or bool(self._standardise)
        self._verification = verification_of(sources.tables, read)
        self._pool = BufferPool(blocks=max(read.prefetch_batches, 1) + 1, allocate=allocator(pinned=read.pin_memory))
        self._staging = threading.local()
        self._readers = _open_readers(sources, read)
        self._looking_ahead = [item for item in dict.fromkeys(self._readers) if not isinstance(item, LocalShards)]

    def __reduce__(self) -> tuple[Any, ...]:
        """Cross to another process as settings; what is open stays here.

        Page-locked memory is left to the process that has the GPU: batches cross to it through shared memory.
        """
        elsewhere = replace(self._read, pin_memory=False)
        return partial(StepReader, rank=self._rank, world_size=self._world_size), (self._sources, elsewhere)

    def reopened(self) -> "StepReader":
        """One like this for another process, with files, threads and connections of its own."""
        make, arguments = self.__reduce__()
        return make(*arguments)

    @property
    def readers(self) -> Sequence[ShardReader]:
        """The reader of the shards of each source."""
        return self._readers

    @property
    def asks_stores(self) -> bool:
        """Whether anything is read from behind a URL, so that reading may have to wait for a store."""
        return bool(self._looking_ahead)

    def announce(self, epoch_order: EpochOrder, step: int) -> None:
        """Tell the readers what a step will need, before it is read."""
        for reader in self._looking_ahead:
            refs = np.concatenate(epoch_order.rows(step, self._rank, self._world_size))
            places = clip_places(self._sources, refs)
            reader.expect([span_of(place) for place in places if self._readers[place.source] is reader])

    def read(self, epoch_order: EpochOrder, step: int) -> PackedBatch:
        """Read what this rank has of a step, in the thread of the caller; errors are those of `StepWork`."""
        return done_alone(self.begin(epoch_order, step))

    def begin(self, epoch_order: EpochOrder, step: int) -> "StepWork":
        """Lay out what this rank has of a step, in memory that is taken for it."""
        watch = Stopwatch()
        with watch.measure(Part.COLLATE):
            rows = epoch_order.rows(step, self._rank, self._world_size)
            refs = np.concatenate(rows)
            clips = arrange(rows, clip_places(self._sources, refs), epoch_order)
            layout = batch_layout(clips, len(rows), epoch_order, self._latent_shape, self._dtype)
            packed = PackedBatch(
                block=self._pool.take(layout.size_bytes),
                layout=layout,
                spans=tuple(clip.span for clip in clips),
                refs=refs,
                keys=tuple(clip.place.key for clip in clips),
                epoch=epoch_order.epoch,
                step=step,
            )
            work = StepWork(
                packed=packed,
                clips=clips,
                memory=memoryview(packed.block.numpy()),
                targets=packed.tensors() if self._converts else {},
                read_clip=self._read_clip,
            )
        work.watches.append(watch)
        return work

    def close(self) -> None:
        """Give back files, threads and connections."""
        for reader in self._readers:
            reader.close()

    def _read_clip(self, work: "StepWork", clip: ArrangedClip, watch: Stopwatch) -> np.ndarray:
        """Read one clip into the batch; returns the last camera position, float32 [3]."""
        place = clip.place
        slots = slots_of(work.packed.layout, work.memory, clip)
        staged = self._staged(clip) if self._converts else {}
        slots |= {name: memoryview(latents.numpy()).cast("B") for name, latents in staged.items()}
        due = self._verification.is_due(place.source, place.number)
        reader = self._readers[place.source]
        last_pose = read_clip(reader, place, self._latent_shape, list(slots.values()), checked=due, watch=watch)
        if due:
            self._verification.passed(place.source, place.number)
        for name, latents in staged.items():
            with watch.measure(Part.COLLATE):
                out = work.targets[name][clip.span.place]
                convert(latents, out, self._standardise.get(name))
        return last_pose[:3]

    def _staged(self, clip: ArrangedClip) -> dict[str, torch.Tensor]:
        """Memory of this thread for the stored latents of a clip; it stays in the cache from clip to clip."""
        shape = (len(LATENT_TENSORS), clip.span.length, *self._latent_shape)
        size = int(np.prod(shape))
        held = getattr(self._staging, "held", None)
        if held is None or len(held) < size:
            held = self._staging.held = torch.empty(size, dtype=_STORED)
        return dict(zip(LATENT_TENSORS, held[:size].view(shape), strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class StepWork:
    """What one rank has of a step, to be read clip by clip, in any order and by several threads at the same time.

    Attributes:
        packed: the batch to be.
        clips: what is read into it.
        memory: block of the batch, as bytes.
        targets: tensors of the batch by name, where what is read is not yet what is delivered.
        read_clip: reads a clip into this; gives the last camera position.
        goals: what it gave, by number of the clip.
        watches: seconds of all that was done.
    """

    packed: PackedBatch
    clips: Sequence[ArrangedClip]
    memory: memoryview
    targets: Mapping[str, torch.Tensor]
    read_clip: "Callable[[StepWork, ArrangedClip, Stopwatch], np.ndarray]"
    goals: dict[int, np.ndarray] = field(default_factory=dict)
    watches: list[Stopwatch] = field(default_factory=list)

    @property
    def parts(self) -> int:
        """Clips."""
        return len(self.clips)

    def make(self, part: int) -> None:
        """Read a clip.

        Raises:
            IntegrityError: its bytes are not those that the release vouches for; names shard and clip.
            StoreError: a store failed for good.
            OSError: the system refuses to read.
        """
        watch = Stopwatch()
        self.goals[part] = self.read_clip(self, self.clips[part], watch)
        self.watches.append(watch)

    def complete(self) -> PackedBatch:
        """Describe what was read; the batch is whole then."""
        watch = Stopwatch()
        with watch.measure(Part.COLLATE):
            goals = [self.goals[part] for part in range(self.parts)]
            layout, packed = self.packed.layout, self.packed
            describe(layout, self.memory, self.clips, goals)
        return replace(packed, seconds=total_seconds([*self.watches, watch]))


def _open_readers(sources: Sources, read: ReadConfig) -> Sequence[ShardReader]:
    """A reader for each source; sources of one release share it."""
    by_root: dict[str, ShardReader] = {}
    for table in sources.tables:
        root = table.release.store.root
        if root not in by_root:
            by_root[root] = open_shards(table.release.store, table.release.manifest, read)
    return [by_root[table.release.store.root] for table in sources.tables]
