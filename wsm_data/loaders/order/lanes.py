"""Rows dealt to the slots of global steps.

Slot j of every step reads along a lane of its own, one of `global_batch` equal stretches of the epoch's order: a step
mixes places that lie far apart, and the ranks, which hold different slots, read different shards.
"""

import numpy as np
from numpy.typing import NDArray

from wsm_data.loaders.config import OrderConfig, Remainder
from wsm_data.loaders.order.stable_hash import Draw, mix64, permutation
from wsm_data.schema.arrays import Int64Array

EMPTY_ROW = -1
"""In place of the number of a row: the slot stays empty."""


def deal_lanes(rows: int, order: OrderConfig) -> Int64Array:
    """Which row stands in which slot of which step.

    With shuffle, lane j has the rows [floor(j R / B), floor((j + 1) R / B)) of the R rows; a step takes one row from
    each of the B lanes. Without shuffle, step s has the rows [s B, (s + 1) B). Either way all steps are full but one,
    the last, for which the remainder policy decides: it is dropped, filled with rows from the beginning, or padded.

    Args:
        rows: R, rows of the epoch.
        order: shuffle, global batch and remainder policy.

    Returns:
        numbers of rows, `EMPTY_ROW` for an empty slot; int64 [B, steps].
    """
    batch = order.global_batch
    full = rows // batch
    steps = full if order.remainder is Remainder.DROP else -(-rows // batch)
    if order.shuffle:
        starts = np.arange(batch + 1) * rows // batch
        slots = starts[:-1, None] + np.arange(steps)
        missing = slots >= starts[1:, None]
    else:
        slots = np.arange(batch)[:, None] + np.arange(steps) * batch
        missing = slots >= rows
    if steps > full:
        count = int(missing.sum())
        fill = np.arange(count) % rows if order.remainder is Remainder.REPEAT else EMPTY_ROW
        slots[missing] = fill
    return slots


def bucket_lanes(slots: Int64Array, lengths: NDArray[np.integer], order: OrderConfig, epoch: int) -> Int64Array:
    """Let rows of similar length meet in a step, without a row leaving its lane or its pool of steps.

    Within each pool every lane sorts its rows by length, so that a step has rows of the same quantile of length; then
    the steps of the pool are permuted, if the order is shuffled.

    Args:
        slots: numbers of rows, no slot empty; int64 [B, steps].
        lengths: length of each row; integer [rows].
        order: seed, shuffle and pool.
        epoch: number of the epoch.

    Returns:
        int64 [B, steps].
    """
    steps = np.arange(slots.shape[1])
    pools = steps // order.pool
    bits = (order.pool - 1).bit_length()
    keys = lengths[slots].astype(np.int64)
    keys <<= bits
    keys |= steps % order.pool  # equal lengths stay in the order in which they came
    for first in range(0, len(steps), order.pool):
        keys[:, first : first + order.pool].sort(axis=1)
    chosen = keys & ((1 << bits) - 1)
    chosen += pools * order.pool
    if order.shuffle:
        pool_sizes = np.bincount(pools)
        chosen = chosen[:, permutation(mix64(steps, order.seed, Draw.STEPS, epoch), pool_sizes)]
    return np.take_along_axis(slots, chosen, axis=1)
