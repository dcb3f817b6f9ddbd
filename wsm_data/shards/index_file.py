"""index.parquet on a disk or in memory, of which only the columns and rows are read that somebody asks for."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from itertools import accumulate

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.errors import IntegrityError
from wsm_data.shards.index_row import INDEX_VERSION, SCHEMA
from wsm_data.shards.row_blocks import RowBlocks

_KEPT_CHOICES = 4  # a program asks for few choices of columns


class IndexFile:
    """The columns of an index file; safe to be read by several threads.

    Every page that is read is compared with its checksum.

    Args:
        file: the content, at random access; it stays open as long as this object lives.
        where: its place, for messages.

    Raises:
        IntegrityError: it is not an index of this version.
    """

    def __init__(self, file: pa.NativeFile, where: str):
        self._file, self._where = file, where
        with self._readable():
            self._metadata = pq.read_metadata(file)
            schema = self._metadata.schema.to_arrow_schema()
            if (schema.metadata or {}).get(b"wsm.index_version") != INDEX_VERSION.encode():
                raise ValueError(f"wsm.index_version must be {INDEX_VERSION}; use a matching wsm")
            if schema != SCHEMA:
                raise ValueError(f"its columns must be those of docs/format.md, found {schema.names}")
        sizes = [self._metadata.row_group(number).num_rows for number in range(self._metadata.num_row_groups)]
        self._starts = [0, *accumulate(sizes)]
        self._blocks = lru_cache(_KEPT_CHOICES)(self._make_blocks)

    def __len__(self) -> int:
        return int(self._metadata.num_rows)

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns, with all their rows; nothing is kept of them here.

        Raises:
            IntegrityError: a page is damaged.
        """
        with self._readable():
            return self._open().read(list(names)).select(list(names))

    def values(self, names: Sequence[str], rows: np.ndarray) -> list[np.ndarray]:
        """Some columns at some rows, in the order of `rows`; texts as arrays of objects. Rows around them are kept.

        Raises:
            IntegrityError: a page is damaged.
        """
        return self._blocks(tuple(names)).values(rows)

    def _make_blocks(self, names: tuple[str, ...]) -> RowBlocks:
        return RowBlocks(partial(self._read_rows, names), len(self), len(names))

    def _read_rows(self, names: tuple[str, ...], start: int, end: int) -> tuple[int, pa.Table]:
        groups = range(bisect_right(self._starts, start) - 1, bisect_left(self._starts, end))
        with self._readable():
            return self._starts[groups[0]], self._open().read_row_groups(groups, list(names)).select(list(names))

    def _open(self) -> pq.ParquetFile:
        return pq.ParquetFile(self._file, metadata=self._metadata, page_checksum_verification=True)

    @contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except (pa.ArrowException, OSError, ValueError) as error:
            raise IntegrityError(
                f"{self._where} must be the index of a release, but: {error}; restore the file"
            ) from error
