"""index.parquet on a disk or in memory, of which only the columns and rows are read that somebody asks for."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from itertools import accumulate
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.errors import IntegrityError
from wsm_data.files.tables import opened_table, require_columns
from wsm_data.shards.index.row import CHECKSUM_COLUMNS, INDEX_VERSION, SCHEMA
from wsm_data.shards.row_blocks import RowBlocks

OpenFile = Callable[[], pa.NativeFile]


class IndexFile:
    """The columns of an index file; safe to be read by several threads. No file is open between two reads.

    Every page that is read is compared with its checksum.

    Args:
        open_file: gives the content at random access; called for every read.
        where: its place, for messages.

    Raises:
        IntegrityError: it is not an index of this version.
    """

    def __init__(self, open_file: OpenFile, where: str):
        self._open_file, self._where = open_file, where
        self._metadata: pq.FileMetaData | None = None
        with self._opened() as file:
            if (file.schema_arrow.metadata or {}).get(b"wsm.index_version") != INDEX_VERSION.encode():
                raise ValueError(f"wsm.index_version must be {INDEX_VERSION}; use a matching wsm")
            require_columns(file.schema_arrow, SCHEMA)
            self._metadata = file.metadata
            _require_rows(file.metadata.num_rows, self._size_bytes())
            sizes = [file.metadata.row_group(number).num_rows for number in range(file.num_row_groups)]
        self._starts = [0, *accumulate(sizes)]
        self._blocks: dict[tuple[str, ...], RowBlocks] = {}  # a program asks for few choices of columns

    def __len__(self) -> int:
        return self._starts[-1]

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns, with all their rows; nothing is kept of them here.

        Raises:
            IntegrityError: a page is damaged.
        """
        with self._opened() as file:
            return file.read(list(names)).select(list(names))

    def parts(self, name: str) -> Iterator[pa.ChunkedArray]:
        """A column group by group. Read at once, each part of a dictionary column would repeat all values before it.

        Raises:
            IntegrityError: a page is damaged.
        """
        with self._opened() as file:
            for group in range(file.num_row_groups):
                yield file.read_row_group(group, [name], use_threads=False)[name]

    def values(self, names: Sequence[str], rows: np.ndarray) -> list[np.ndarray]:
        """Some columns at some rows, in the order of `rows`; texts as arrays of objects. Rows around them are kept.

        Raises:
            IntegrityError: a page is damaged.
        """
        chosen = tuple(names)
        blocks = self._blocks.setdefault(chosen, RowBlocks(len(self), len(chosen)))
        return blocks.values(rows, partial(self._read_rows, chosen))

    def _read_rows(self, names: tuple[str, ...], start: int, end: int) -> tuple[int, pa.Table]:
        groups = range(bisect_right(self._starts, start) - 1, bisect_left(self._starts, end))
        with self._opened() as file:
            return self._starts[groups[0]], file.read_row_groups(groups, list(names)).select(list(names))

    def _size_bytes(self) -> int:
        with self._open_file() as file:
            return int(file.size())

    def _opened(self) -> AbstractContextManager[pq.ParquetFile]:
        must_be = f"{self._where} must be the index of a release"
        return opened_table(self._open_file, must_be, "restore the file", self._metadata)


def _require_rows(rows: int, size_bytes: int) -> None:
    """Rows are believed before they are read: a file cannot have more of them than it has room for their checksums."""
    most = size_bytes // (8 * len(CHECKSUM_COLUMNS))
    if rows > most:
        raise ValueError(f"a file of {size_bytes} bytes must have at most {most} rows, and declares {rows}")


@contextmanager
def local_file(path: str) -> Iterator[tuple[pa.NativeFile, OpenFile]]:
    """Open a file, and get the function that opens the same file again.

    That function raises an IntegrityError where the file was replaced or written to in the meantime, so that what was
    hashed once needs not be hashed again.

    Raises:
        FileNotFoundError: there is no such file.
    """
    with pa.OSFile(path) as file:
        yield file, partial(_open_again, path, _identity(path))


def _open_again(path: str, identity: tuple[int, ...]) -> pa.NativeFile:
    try:
        file = pa.OSFile(path)
        found = _identity(path)  # asked for after it was opened: the file that is open cannot be a later one
    except FileNotFoundError as error:
        raise IntegrityError(f"{path} is missing since the release was opened; fetch it again") from error
    if found != identity:
        raise IntegrityError(f"{path} was changed since the release was opened; open the release again")
    return file


def _identity(path: str) -> tuple[int, ...]:
    found = Path(path).stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
