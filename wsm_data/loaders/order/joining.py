"""Several clips in one row: each row takes the oldest clip that waits, then whatever fills the rest best."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import Int64Array


def join_rows(lengths: NDArray[np.integer], *, row_latents: int, pool: int) -> tuple[Int64Array, Int64Array]:
    """Best fit with a bounded pool: at any time the next `pool` clips that have no row yet wait.

    A row starts with the clip that has waited longest, so that none waits for ever; then the longest waiting clip that
    still fits is added, the oldest of equal ones, until none fits. The pool is refilled from the sequence after each.

    Args:
        lengths: length of each clip in the order of the epoch, from 1 to `row_latents`; integer [clips].
        row_latents: what a row holds.
        pool: clips that wait at the same time, at least 1.

    Returns:
        The clips in the order of their rows, int64 [clips], and where each row starts among them, int64 [rows + 1].
    """
    taken, starts, rows = _join(lengths.astype(np.int32, copy=False), row_latents, pool)
    return taken, starts[: rows + 1].copy()


@njit(cache=True)  # type: ignore[untyped-decorator]
def _join(lengths: NDArray[np.int32], row_latents: int, pool: int) -> tuple[Int64Array, Int64Array, int]:
    """The waiting clips of each length form a queue: `first` and `last` of a length, and who follows a clip."""
    clips = len(lengths)
    follower = np.full(clips, -1, np.int64)
    first = np.full(row_latents + 1, -1, np.int64)
    last = np.full(row_latents + 1, -1, np.int64)
    is_taken = np.zeros(clips, np.bool_)
    taken = np.empty(clips, np.int64)
    starts = np.zeros(clips + 1, np.int64)
    admitted, oldest, rows, count = 0, 0, 0, 0
    while count < clips:
        while oldest < admitted and is_taken[oldest]:
            oldest += 1
        room = row_latents
        wanted = -1  # the first clip of a row is the oldest, whatever its length
        while True:
            while admitted < clips and admitted - count < pool:
                length = lengths[admitted]
                if first[length] < 0:
                    first[length] = admitted
                else:
                    follower[last[length]] = admitted
                last[length] = admitted
                admitted += 1
            length = lengths[oldest] if wanted < 0 else min(wanted, room)
            while length > 0 and first[length] < 0:
                length -= 1
            if length == 0:
                break
            clip = first[length]
            first[length] = follower[clip]
            is_taken[clip] = True
            taken[count] = clip
            count += 1
            room -= length
            wanted = room
        rows += 1
        starts[rows] = count
    return taken, starts, rows
