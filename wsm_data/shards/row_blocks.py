"""Values of scattered rows of an index that is too large for memory: the rows around them are kept for a while.

A loader comes back to the rows of a shard until it has read the shard, and so do most others. A group of rows, the
least that can be read of a file, is large; therefore only the blocks that were asked for are kept of it.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence

import numpy as np
import pyarrow as pa

from wsm_data.files.arrow_arrays import numpy_of

_BLOCK_ROWS = 512  # about two shards
_KEPT_VALUES = 1 << 22
"""32 MB of numbers: for the 17 columns that a loader reads, a quarter of a million rows. With half of it, not all
blocks would stay that a process with 48 rows of a step reads from in turn, but be read ten times as often."""

ReadRows = Callable[[int, int], tuple[int, pa.Table]]
Block = tuple[np.ndarray, ...]


class RowBlocks:
    """Some columns of an index, read in groups of rows and kept in blocks; safe to be used by several threads.

    Args:
        rows: rows of the index.
        columns: how many columns the tables have.
    """

    def __init__(self, rows: int, columns: int):
        self._rows = rows
        self._kept_blocks = max(_KEPT_VALUES // (_BLOCK_ROWS * columns), 1)
        self._blocks: OrderedDict[int, Block] = OrderedDict()
        self._lock = threading.Lock()

    def values(self, rows: np.ndarray, read: ReadRows) -> list[np.ndarray]:
        """Each column at some rows, in the order of `rows`; texts as arrays of objects.

        Args:
            rows: numbers of rows, at least one.
            read: reads at least the rows from its first argument up to its second; gives the first row and the table.
        """
        numbers, place = np.unique(rows // _BLOCK_ROWS, return_inverse=True)
        with self._lock:
            blocks = [self._block(number, read) for number in numbers.tolist()]
        at = place * _BLOCK_ROWS + rows % _BLOCK_ROWS  # only the last block of an index may be shorter
        if len(blocks) == 1:
            return [values[at] for values in blocks[0]]
        return [np.concatenate(parts)[at] for parts in zip(*blocks, strict=True)]

    def _block(self, number: int, read: ReadRows) -> Block:
        if number not in self._blocks:
            self._read_block(number, read)
        self._blocks.move_to_end(number)
        found = self._blocks[number]
        while len(self._blocks) > self._kept_blocks:
            self._blocks.popitem(last=False)
        return found

    def _read_block(self, number: int, read: ReadRows) -> None:
        start, end = self._bounds(number)
        first, table = read(start, end)
        numbers: Sequence[int] = [number]
        if self._rows <= self._kept_blocks * _BLOCK_ROWS:  # all that was read may stay
            whole = range(-(-first // _BLOCK_ROWS), -(-(first + len(table)) // _BLOCK_ROWS))
            numbers = [other for other in whole if self._bounds(other)[1] <= first + len(table)]
        for other in numbers:
            start, end = self._bounds(other)
            self._blocks[other] = _arrays(table.slice(start - first, end - start))

    def _bounds(self, number: int) -> tuple[int, int]:
        return number * _BLOCK_ROWS, min((number + 1) * _BLOCK_ROWS, self._rows)


def _arrays(table: pa.Table) -> Block:
    """Columns as arrays that own their memory: a view would keep everything that was read with them."""
    return tuple(np.array(numpy_of(column)) for column in table.columns)
