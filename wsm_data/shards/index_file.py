"""index.parquet on a disk or in memory, of which only the columns and rows are read that somebody asks for."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import accumulate

import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.errors import IntegrityError
from wsm_data.shards.index_row import INDEX_VERSION, SCHEMA

_KEPT_GROUPS = 4


class IndexFile:
    """The columns of an index file; safe to be read by several threads, and after a fork.

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
        self._group = lru_cache(_KEPT_GROUPS)(self._read_group)

    def __len__(self) -> int:
        return int(self._metadata.num_rows)

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns, with all their rows; nothing is kept of them here.

        Raises:
            IntegrityError: a page is damaged.
        """
        with self._readable():
            return self._open().read(list(names))

    def around(self, row: int) -> tuple[int, pa.Table]:
        """All columns of a stretch of rows that holds `row`, and the first row of the stretch. A few are kept.

        Raises:
            IntegrityError: a page is damaged.
        """
        group = bisect_right(self._starts, row) - 1
        return self._starts[group], self._group(group)

    def _read_group(self, group: int) -> pa.Table:
        with self._readable():
            return self._open().read_row_group(group)

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
