"""index.parquet: one row per clip, in the order of the shards, with the place and checksum of every member."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from wsm_data.errors import ConfigError
from wsm_data.files.arrow_arrays import arrow_numbers, arrow_texts, numpy_of
from wsm_data.files.atomic import atomic_file
from wsm_data.shards.index.file import IndexFile
from wsm_data.shards.index.row import (
    COUNT_COLUMNS,
    PLACE_COLUMNS,
    REPEATED_COLUMNS,
    SCHEMA,
    UNIQUE_COLUMNS,
    IndexRow,
    parse_row,
    row_record,
)

_ROW_GROUP_ROWS = 1 << 14
"""What is read for a single row: small enough for 5 ms, large enough for a footer of 3 MB at ten million rows."""


def index_table(rows: Iterable[IndexRow]) -> pa.Table:
    """Columns of the index, in the order of the rows."""
    return pa.Table.from_pylist([row_record(row) for row in rows], schema=SCHEMA)


def write_index(path: Path, table: pa.Table) -> None:
    """Write the index atomically; equal rows and an equal pyarrow give equal bytes."""
    texts = {*UNIQUE_COLUMNS, *REPEATED_COLUMNS}
    with (
        atomic_file(path) as file,
        pq.ParquetWriter(
            file,
            SCHEMA,
            write_page_checksum=True,
            compression={name: "zstd" if name in texts else "none" for name in SCHEMA.names},
            use_dictionary=list(REPEATED_COLUMNS),
            column_encoding=dict.fromkeys((*COUNT_COLUMNS, *PLACE_COLUMNS), "DELTA_BINARY_PACKED"),
        ) as writer,
    ):
        for first in range(0, len(table), _ROW_GROUP_ROWS):
            writer.write_table(_with_own_values(table.slice(first, _ROW_GROUP_ROWS)))


def _with_own_values(part: pa.Table) -> pa.Table:
    """The same rows; repeated columns list only their own values, since every group of a file has a list of its own."""
    part = part.combine_chunks()
    for name in REPEATED_COLUMNS:
        column = part[name].cast(pa.string()).dictionary_encode()
        part = part.set_column(part.schema.get_field_index(name), part.schema.field(name), column)
    return part


@dataclass(frozen=True, eq=False)
class IndexTable:
    """The index, column by column. Columns of a file are read when they are asked for, and few rows are kept.

    Every method may raise IntegrityError where the index is a file and a page of it is damaged.

    Attributes:
        content: a file, or a pyarrow table with the columns of `SCHEMA`.
    """

    content: IndexFile | pa.Table

    def __len__(self) -> int:
        return len(self.content)

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns, with all their rows."""
        return self.content.select(names) if isinstance(self.content, pa.Table) else self.content.columns(names)

    def texts(self, column: str) -> list[str]:
        """A text column, such as `key`, in the order of the shards."""
        return list(self.columns([column])[column].to_pylist())

    def numbers(self, column: str) -> np.ndarray:
        """An integer column as an array [rows]."""
        return numpy_of(self.columns([column])[column])

    def parts(self, column: str) -> Iterator[pa.ChunkedArray]:
        """A column part by part, the same rows in the same part of every column; nothing is kept."""
        return self.content.parts(column) if isinstance(self.content, IndexFile) else iter([self.content[column]])

    def codes(self, column: str) -> tuple[np.ndarray, tuple[str, ...]]:
        """A repeated text column, such as `split`, as numbers into its values: int32 [rows], and the values."""
        numbers: dict[str, int] = {}
        codes = [np.empty(0, np.int32)]
        for chunk in (chunk for part in self.parts(column) for chunk in part.chunks if len(chunk)):
            values = chunk.dictionary.to_pylist()
            renumbered = np.array([numbers.setdefault(value, len(numbers)) for value in values], np.int32)
            codes.append(renumbered[numpy_of(chunk.indices)])
        return np.concatenate(codes), tuple(numbers)

    def counts(self, column: str) -> dict[str, int]:
        """How many clips have each value of a repeated text column, sorted by value."""
        codes, values = self.codes(column)
        counts = np.bincount(codes, minlength=len(values)).tolist()
        return {value: count for value, count in sorted(zip(values, counts, strict=True)) if count}

    def values(self, names: Sequence[str], rows: np.ndarray) -> list[np.ndarray]:
        """Some columns at some rows, each in the order of `rows`; texts as arrays of objects.

        Raises:
            IndexError: there is no such row.
        """
        wanted = np.asarray(rows, np.int64)
        if len(wanted) and (wanted.min() < 0 or wanted.max() >= len(self)):
            raise IndexError(f"rows {wanted.min()} to {wanted.max()} of an index of {len(self)} rows")
        if isinstance(self.content, IndexFile) and len(wanted):
            return self.content.values(names, wanted)
        table = self.content if isinstance(self.content, pa.Table) else SCHEMA.empty_table()
        return [numpy_of(column) for column in table.select(names).take(arrow_numbers(wanted)).columns]

    def rows_of(self, keys: Sequence[str] | pa.StringArray) -> np.ndarray:
        """Rows of the clips with these keys, no key twice, -1 where there is no such clip; int64 [keys]."""
        return _places(self.columns(["key"])["key"], keys if isinstance(keys, pa.Array) else arrow_texts(keys))

    def row_at(self, number: int) -> IndexRow:
        """The clip in row `number`.

        Raises:
            IntegrityError: the row contradicts itself.
            IndexError: there is no such row.
        """
        [record] = self._records(np.array([number]))
        return parse_row(record)

    def row(self, key: str) -> IndexRow:
        """The clip with this key.

        Raises:
            ConfigError: there is no such clip.
            IntegrityError: the row contradicts itself.
        """
        place = int(_places(self._keys, arrow_texts([key]))[0])
        if place < 0:
            raise ConfigError(f"the release has no clip {key!r}; `wsm inspect RELEASE` lists what it has")
        return self.row_at(place)

    def rows_of_shard(self, shard: str) -> Iterator[IndexRow]:
        """The clips of a shard, in the order in which they stand in it.

        Raises:
            IntegrityError: a row contradicts itself.
        """
        codes, shards = self._shards
        rows = np.flatnonzero(codes == shards.index(shard)) if shard in shards else np.empty(0, np.int64)
        for record in sorted(self._records(rows), key=lambda record: record["clip_offset"]):
            yield parse_row(record)

    def _records(self, rows: np.ndarray) -> Iterator[dict[str, Any]]:
        """Values of some rows by column."""
        columns = [values.tolist() for values in self.values(SCHEMA.names, rows)]
        for values in zip(*columns, strict=True):
            yield dict(zip(SCHEMA.names, values, strict=True))

    @cached_property
    def _keys(self) -> pa.ChunkedArray:
        return self.columns(["key"])["key"]

    @cached_property
    def _shards(self) -> tuple[np.ndarray, tuple[str, ...]]:
        return self.codes("shard")


def _places(column: pa.ChunkedArray, wanted: pa.StringArray) -> np.ndarray:
    """Where each text stands in a column, -1 where it does not; int64 [wanted]."""
    numbers = pc.index_in(column, value_set=wanted).combine_chunks()
    rows = np.full(len(wanted), -1, np.int64)
    rows[numpy_of(numbers.drop_null())] = np.flatnonzero(numpy_of(numbers.is_valid()))
    return rows


def parse_index(data: bytes, where: str) -> IndexTable:
    """Read a whole index from the bytes of its file.

    Args:
        data: content of an index.parquet.
        where: its place, for messages.

    Raises:
        IntegrityError: it is not an index of this version, or a page is damaged.
    """
    return IndexTable(IndexFile(partial(pa.BufferReader, data), where).columns(SCHEMA.names))
