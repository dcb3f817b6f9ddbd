"""A release as a webdataset pipeline, for training code that wants one: its samples, in the order of our loader.

A sample is what stock webdataset reads from the tars, byte for byte, under the same names: `__key__`, `rgb_latent.npy`,
..., `meta.json`. Beyond it, the order is a pure function of release, seed and epoch, ranks and workers of a DataLoader
share the samples without one twice or missing, and checksums are compared.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch.utils.data
import webdataset

from wsm_data.access.clip_reader import read_members
from wsm_data.access.open_shards import open_shards
from wsm_data.access.shard_reader import ShardReader, Span
from wsm_data.errors import ConfigError
from wsm_data.files.stores import LocalStore
from wsm_data.loaders.config import Arrangement, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import EpochOrder, order_epoch, rows_per_rank
from wsm_data.loaders.ranks import place_among_ranks
from wsm_data.loaders.reading.verification import Verification, verification_of
from wsm_data.loaders.sources.clips import SourceTable, open_sources
from wsm_data.schema.arrays import Int64Array
from wsm_data.shards.members import MEMBER_NAMES


class ClipPipeline(webdataset.DataPipeline, webdataset.FluidInterface):  # type: ignore[misc]
    """A webdataset pipeline over clips: `.map`, `.decode`, `.to_tuple`, `.batched` and the like add steps to it."""

    def set_epoch(self, epoch: int) -> None:
        """Go to the start of an epoch; within a DataLoader, before each `iter` of it.

        Raises:
            ValueError: the number is negative.
        """
        if epoch < 0:
            raise ValueError(f"epoch must be at least 0, found {epoch}")
        self.stage(0).epoch = epoch


def as_webdataset(
    release: str,
    *,
    split: str = "train",
    selection: str = "",
    order: OrderConfig | None = None,
    read: ReadConfig | None = None,
    rank: int | None = None,
    world_size: int | None = None,
) -> ClipPipeline:
    """The clips of a release as a webdataset pipeline.

    A pass that is taken to its end moves the pipeline on to the next epoch, as `.repeat()` does; a DataLoader works on
    copies, so `set_epoch` tells it. A rank has `global_batch / world_size` clips of each global step, and worker w of n
    of a DataLoader has the steps w, w + n, ...: batches of that size come in the order of the steps.

    Args:
        release: path or URL of the release.
        split: split of the clips; empty for all.
        selection: name of a selection of the release, or path of a selection file; empty for all clips of the split.
        order: which clips make up which step; clips come one by one and whole, so `arrangement = join` and
            `max_latents` do not go with it. None: the defaults.
        read: of this, `verify` and what concerns remote shards. None: the defaults.
        rank: number of this rank; None: that of torch.distributed, 0 where it is not initialised.
        world_size: number of ranks; None: that of torch.distributed, 1 where it is not initialised.

    Raises:
        ConfigError: there is no such release, split or selection, or the settings of the order do not go with it.
        IntegrityError: the release is unfinished or damaged.
    """
    order = order or OrderConfig()
    if order.arrangement is Arrangement.JOIN or order.max_latents:
        raise ConfigError(
            f"a webdataset pipeline gives whole clips one by one: arrangement = {order.arrangement} and max_latents = "
            f"{order.max_latents} must be left out; cut or join the samples in a later step of the pipeline"
        )
    rank, world_size = place_among_ranks(rank, world_size)
    rows_per_rank(order, world_size)
    source = SourceConfig(release=release, selection=selection, split=split)
    samples = _Samples(source=source, order=order, read=read or ReadConfig(), rank=rank, world_size=world_size)
    samples.open()
    return ClipPipeline(samples)


@dataclass(kw_only=True)
class _Samples:
    """The first step of the pipeline. Crosses to workers as settings; each process opens the release for itself."""

    source: SourceConfig
    order: OrderConfig
    read: ReadConfig
    rank: int
    world_size: int
    epoch: int = 0
    _opened: "tuple[int, _Opened] | None" = field(default=None, repr=False)

    def __call__(self) -> Iterator[dict[str, Any]]:
        opened = self.open()
        epoch_order = order_epoch([opened.table.layout], self.order, self.epoch)
        worker = torch.utils.data.get_worker_info()
        first, stride = (0, 1) if worker is None else (worker.id, worker.num_workers)
        steps, ahead = range(first, epoch_order.steps, stride), self.read.prefetch_batches
        for number, step in enumerate(steps):
            for coming in steps[number + ahead if number else 0 : number + ahead + 1]:
                opened.announce(self._refs(epoch_order, coming))
            for ref in self._refs(epoch_order, step).tolist():
                yield opened.sample(ref)
        self.epoch = epoch_order.epoch + 1

    def _refs(self, epoch_order: EpochOrder, step: int) -> Int64Array:
        return np.concatenate(epoch_order.rows(step, self.rank, self.world_size))

    def open(self) -> "_Opened":
        """The release, opened by this process."""
        if self._opened is None or self._opened[0] != os.getpid():
            [table] = open_sources([self.source]).tables
            verification = verification_of([table], self.read)
            self._opened = (
                os.getpid(),
                _Opened(table, open_shards(table.release.store, table.release.manifest, self.read), verification),
            )
        return self._opened[1]

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_opened": None}

    def close(self) -> None:
        """Give back what is open; called by the pipeline."""
        if self._opened is not None:
            self._opened[1].reader.close()
            self._opened = None


@dataclass(frozen=True, eq=False)
class _Opened:
    table: SourceTable
    reader: ShardReader
    verification: Verification

    def announce(self, refs: Int64Array) -> None:
        """Tell the reader which clips come soon, so that a slow store is asked in advance."""
        columns = (self.table.shard_codes, self.table.column("clip_offset"), self.table.column("clip_size"))
        places = zip(*(column[refs].tolist() for column in columns), strict=True)
        self.reader.expect([Span(self.table.shards[code], offset, size) for code, offset, size in places])

    def sample(self, ref: int) -> dict[str, Any]:
        """One clip as stock webdataset spells it."""
        row = self.table.index_row(ref)
        data, members = read_members(self.reader, row, MEMBER_NAMES, checked=self.verification.is_due(0, ref))
        self.verification.passed(0, ref)
        store = self.table.release.store
        sample: dict[str, Any] = {"__key__": row.key, "__url__": f"{store.root}/{row.shard}"}
        if isinstance(store, LocalStore):
            sample["__local_path__"] = sample["__url__"]
        for member in members:
            sample[member.file_name] = bytes(data[member.data_offset : member.data_offset + member.data_size])
        return sample
