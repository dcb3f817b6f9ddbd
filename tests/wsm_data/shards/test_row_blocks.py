from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.shards import row_blocks
from wsm_data.shards.row_blocks import RowBlocks

BLOCK = 4


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(row_blocks, "_BLOCK_ROWS", BLOCK)


class Table:
    """A table of two columns that is read in groups of rows, and counts the reads."""

    def __init__(self, rows: int, group_rows: int):
        self.whole = pa.table({"number": np.arange(rows), "text": [f"row {row}" for row in range(rows)]})
        self.group_rows = group_rows
        self.reads: list[tuple[int, int]] = []

    def read(self, start: int, end: int) -> tuple[int, pa.Table]:
        self.reads.append((start, end))
        first = start // self.group_rows * self.group_rows
        last = -(-end // self.group_rows) * self.group_rows
        return first, self.whole.slice(first, last - first)

    def blocks(self, kept: int) -> RowBlocks:
        blocks = RowBlocks(len(self.whole), 2)
        blocks._kept_blocks = kept
        return blocks


@given(st.integers(1, 40), st.integers(1, 13), st.integers(1, 12), st.data())
def test_values_are_those_of_the_rows_in_their_order(
    rows: int, group_rows: int, kept: int, data: st.DataObject
) -> None:
    table = Table(rows, group_rows)
    blocks = table.blocks(kept)
    for _ in range(3):
        wanted = data.draw(st.lists(st.integers(0, rows - 1), min_size=1, max_size=20))
        numbers, texts = blocks.values(np.array(wanted), table.read)
        assert numbers.tolist() == wanted
        assert texts.tolist() == [f"row {row}" for row in wanted]
        assert len(blocks._blocks) <= kept


def test_what_was_read_is_not_read_again() -> None:
    table = Table(40, 8)
    blocks = table.blocks(kept=3)
    for _ in range(3):
        blocks.values(np.array([0, 9, 17, 10, 1]), table.read)
    assert table.reads == [(0, 4), (8, 12), (16, 20)]
    blocks.values(np.array([39]), table.read)  # the block of rows 0 to 3 has waited longest, and goes
    blocks.values(np.array([9, 17]), table.read)
    assert table.reads[3:] == [(36, 40)]
    blocks.values(np.array([0]), table.read)
    assert table.reads[4:] == [(0, 4)]


def test_of_an_index_that_fits_everything_that_was_read_is_kept() -> None:
    table = Table(22, 8)
    blocks = table.blocks(kept=6)
    for row in range(22):
        blocks.values(np.array([row]), table.read)
    assert table.reads == [(0, 4), (8, 12), (16, 20)]


def test_values_keep_nothing_else_in_memory() -> None:
    table = Table(40, 40)
    numbers, _ = table.blocks(kept=1)._block(2, table.read)
    assert numbers.base is None
    assert len(numbers) == BLOCK


def test_threads_get_what_they_ask_for() -> None:
    table = Table(400, 16)
    blocks = table.blocks(kept=5)
    wanted = [np.random.default_rng(seed).integers(0, 400, 30) for seed in range(40)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda rows: blocks.values(rows, table.read), wanted))
    for rows, (numbers, texts) in zip(wanted, found, strict=True):
        np.testing.assert_array_equal(numbers, rows)
        assert texts.tolist() == [f"row {row}" for row in rows]
