from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.order.joining import join_rows

ROW = 16
LENGTHS = st.lists(st.integers(1, ROW), max_size=60)
POOL = st.integers(1, 20)


def slow_rows(lengths: list[int], row_latents: int, pool: int) -> list[list[int]]:
    """The documentation as lists: the oldest clip, then each time the longest that fits, the oldest of equal ones."""
    waiting, rows, admitted = [], [], 0
    while admitted < len(lengths) or waiting:
        row: list[int] = []
        while True:
            while admitted < len(lengths) and len(waiting) < pool:
                waiting.append(admitted)
                admitted += 1
            room = row_latents - sum(lengths[clip] for clip in row)
            fitting = [clip for clip in waiting if lengths[clip] <= room]
            if not fitting:
                break
            clip = max(fitting, key=lambda clip: (lengths[clip], -clip)) if row else waiting[0]
            waiting.remove(clip)
            row.append(clip)
        rows.append(row)
    return rows


def joined(lengths: list[int], pool: int) -> list[list[int]]:
    taken, starts = join_rows(np.array(lengths, np.int64), row_latents=ROW, pool=pool)
    return [taken[first:end].tolist() for first, end in pairwise(starts)]


@given(LENGTHS, POOL)
def test_rows_are_those_of_the_slow_reference(lengths: list[int], pool: int) -> None:
    assert joined(lengths, pool) == slow_rows(lengths, ROW, pool)


@given(LENGTHS, POOL)
def test_every_clip_stands_in_one_row_and_no_row_is_too_long(lengths: list[int], pool: int) -> None:
    rows = joined(lengths, pool)
    assert sorted(clip for row in rows for clip in row) == list(range(len(lengths)))
    assert all(0 < sum(lengths[clip] for clip in row) <= ROW for row in rows)


@given(LENGTHS, POOL)
def test_no_clip_is_taken_before_it_waits_or_left_behind_for_long(lengths: list[int], pool: int) -> None:
    taken, _ = join_rows(np.array(lengths, np.int64), row_latents=ROW, pool=pool)
    assert all(clip < place + pool for place, clip in enumerate(taken.tolist()))
    rows = joined(lengths, pool)
    row_of = {clip: number for number, row in enumerate(rows) for clip in row}
    assert all(row_of[clip] <= clip for clip in row_of)  # the oldest starts a row: at worst one row for each before it


def test_a_pool_of_one_fills_rows_in_order() -> None:
    assert joined([10, 6, 8, 9, 4], 1) == [[0, 1], [2], [3, 4]]


def test_a_larger_pool_wastes_less() -> None:
    lengths = np.random.default_rng(0).integers(1, ROW + 1, 2000).tolist()
    counts = [len(joined(lengths, pool)) for pool in (1, 4, 16, 64)]
    assert counts == sorted(counts, reverse=True)
    # where 64 clips wait, what fits is nearly always among them: 2 % is twice what these lengths waste
    assert counts[-1] < 1.02 * sum(lengths) / ROW < counts[0]
