"""The order of an epoch, a pure function of sources and settings: which clips stand in which row of which step."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import Arrangement, OrderConfig
from wsm_data.loaders.order.lanes import EMPTY_ROW, bucket_lanes, deal_lanes
from wsm_data.loaders.order.mixing import mixed_refs
from wsm_data.loaders.order.pass_order import Int32Array, SourceLayout
from wsm_data.loaders.order.stable_hash import Draw, mix64
from wsm_data.schema.arrays import Int64Array


@dataclass(frozen=True, kw_only=True)
class EpochSummary:
    """What becomes of the clips of an epoch.

    Attributes:
        clips: clips that the sources give to the epoch.
        rows: rows they make up.
        steps: global steps.
        dropped_clips: clips of the epoch that stand in no step.
        repeated_rows: rows that stand in a second step.
        padded_rows: slots without a row.
        padding_share: latents of all steps that are padding, where every row is as long as the longest of its step over
            all ranks, or `row_latents` of joined clips; 0 to 1. Batches of a rank are padded to their own longest
            row and have no more than that.
    """

    clips: int
    rows: int
    steps: int
    dropped_clips: int
    repeated_rows: int
    padded_rows: int
    padding_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class EpochOrder:
    """All global steps of an epoch.

    Attributes:
        epoch: number of the epoch.
        config: settings of the order.
        refs: clips of the epoch, row after row; int64 [clips].
        row_starts: first clip of each row in `refs`, and the end; int64 [rows + 1]. None where each row is one clip.
        slots: row in each slot of each step, `EMPTY_ROW` where there is none; int64 [global_batch, steps].
        sequence_latents: latents of every clip of the sources by ref, cut to `max_latents`; int32 [all clips].
    """

    epoch: int
    config: OrderConfig
    refs: Int64Array
    row_starts: Int64Array | None
    slots: Int64Array
    sequence_latents: Int32Array

    @property
    def steps(self) -> int:
        """Global steps of the epoch; every rank has as many."""
        return int(self.slots.shape[1])

    def rows(self, step: int, rank: int, world_size: int) -> list[Int64Array]:
        """Refs in each row that a rank has in a step; an empty array for an empty row.

        Rank r has the slots [r B / W, (r + 1) B / W): one rank after the other, all ranks together have the same rows
        in the same order for every world size.

        Raises:
            ConfigError: the world size does not divide the global batch.
            ValueError: there is no such step or rank.
        """
        share = rows_per_rank(self.config, world_size)
        if not (0 <= step < self.steps and 0 <= rank < world_size):
            raise ValueError(f"step {step} of {self.steps} and rank {rank} of {world_size} must exist")
        numbers = self.slots[rank * share : (rank + 1) * share, step]
        return [self._row(int(number)) for number in numbers]

    @cached_property
    def summary(self) -> EpochSummary:
        """What becomes of the clips; counted when it is first asked for."""
        clips_per_row = np.ones(len(self.refs), np.int64) if self.row_starts is None else np.diff(self.row_starts)
        times = np.bincount(self.slots[self.slots != EMPTY_ROW], minlength=len(clips_per_row))
        return EpochSummary(
            clips=len(self.refs),
            rows=len(clips_per_row),
            steps=self.steps,
            dropped_clips=int(clips_per_row[times == 0].sum()),
            repeated_rows=int(np.maximum(times - 1, 0).sum()),
            padded_rows=int((self.slots == EMPTY_ROW).sum()),
            padding_share=self._padding_share(),
        )

    def _row(self, number: int) -> Int64Array:
        if number == EMPTY_ROW:
            return np.empty(0, np.int64)
        starts = self.row_starts
        return self.refs[number : number + 1] if starts is None else self.refs[starts[number] : starts[number + 1]]

    def _padding_share(self) -> float:
        lengths = np.append(_row_lengths(self.refs, self.row_starts, self.sequence_latents), 0)  # of EMPTY_ROW, last
        in_slots = lengths[self.slots]
        longest = self.config.row_latents or in_slots.max(axis=0, initial=0)
        space = int(np.sum(longest * np.ones(self.steps, np.int64))) * self.config.global_batch
        return 1 - int(in_slots.sum()) / space if space else 0.0


def order_epoch(layouts: Sequence[SourceLayout], order: OrderConfig, epoch: int) -> EpochOrder:
    """Order an epoch.

    Args:
        layouts: the sources.
        order: the settings.
        epoch: number of the epoch, from 0.

    Raises:
        ConfigError: a clip does not fit into a row, or the epoch has no step.
    """
    sequence_latents = _sequence_latents(layouts, order)
    refs, row_starts = _rows(mixed_refs(layouts, order, epoch), sequence_latents, order)
    rows = len(refs) if row_starts is None else len(row_starts) - 1
    slots = deal_lanes(rows, order) if rows else np.empty((order.global_batch, 0), np.int64)
    if not slots.shape[1]:
        raise ConfigError(
            f"epoch {epoch} must have at least one step, but its {rows} rows do not fill a global batch of "
            f"{order.global_batch}; lower global_batch, raise the weight of a source, or set remainder to repeat or pad"
        )
    if order.arrangement is Arrangement.BUCKET:
        full = rows // order.global_batch
        lengths = sequence_latents[refs]
        slots[:, :full] = bucket_lanes(slots[:, :full], lengths, order, epoch)
    return EpochOrder(
        epoch=epoch,
        config=order,
        refs=refs,
        row_starts=row_starts,
        slots=slots,
        sequence_latents=sequence_latents,
    )


def rows_per_rank(order: OrderConfig, world_size: int) -> int:
    """Rows of a step that each rank has.

    Raises:
        ConfigError: the world size does not divide the global batch.
    """
    if world_size < 1 or order.global_batch % world_size:
        raise ConfigError(
            f"the number of ranks must divide global_batch = {order.global_batch}, found {world_size}; change one of "
            "them, so that every rank has as many rows of a step"
        )
    return order.global_batch // world_size


def chunk_sizes(refs: Int64Array, order: OrderConfig, epoch: int) -> Int64Array:
    """Chunk size K of each sequence, drawn once for a clip in an epoch.

    Args:
        refs: the clips; int64 of any shape.
        order: seed, and what K is drawn from.
        epoch: number of the epoch.

    Returns:
        int64 of the shape of `refs`.
    """
    choices = np.array(order.chunk_sizes, np.int64)
    drawn = mix64(refs, order.seed, Draw.CHUNK_SIZES, epoch) % np.uint64(len(choices))
    return np.asarray(choices[drawn.astype(np.int64)])


def _sequence_latents(layouts: Sequence[SourceLayout], order: OrderConfig) -> Int32Array:
    latents = layouts[0].latents if len(layouts) == 1 else np.concatenate([layout.latents for layout in layouts])
    return np.minimum(latents, np.int32(order.max_latents)) if order.max_latents else latents


def _rows(refs: Int64Array, sequence_latents: Int32Array, order: OrderConfig) -> tuple[Int64Array, Int64Array | None]:
    """Refs row after row, and where each row starts; None where each is one clip."""
    if order.arrangement is not Arrangement.JOIN:
        return refs, None
    from wsm_data.loaders.order.joining import join_rows  # numba, for those who join clips

    _require_fitting(sequence_latents, order)
    taken, starts = join_rows(sequence_latents[refs], row_latents=order.row_latents, pool=order.pool)
    return refs[taken], starts


def _require_fitting(sequence_latents: Int32Array, order: OrderConfig) -> None:
    longest = int(sequence_latents.max(initial=0))
    if longest > order.row_latents:
        raise ConfigError(
            f"every sequence must fit into a row of row_latents = {order.row_latents}, but one has {longest} latents; "
            f"set row_latents to at least {longest}, or max_latents to at most {order.row_latents}"
        )


def _row_lengths(refs: Int64Array, row_starts: Int64Array | None, sequence_latents: Int32Array) -> Int64Array:
    if row_starts is None:
        return sequence_latents[refs].astype(np.int64)
    ends = np.concatenate([[0], np.cumsum(sequence_latents[refs], dtype=np.int64)])
    return np.diff(ends[row_starts])
