"""index.parquet: one row per clip, in the order of the shards, with the place and checksum of every member."""

from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.shards.index_row import (
    COUNT_COLUMNS,
    INDEX_VERSION,
    PLACE_COLUMNS,
    REPEATED_COLUMNS,
    SCHEMA,
    UNIQUE_COLUMNS,
    IndexRow,
    parse_row,
    row_record,
)

_ROW_GROUP_ROWS = 1 << 20


def index_table(rows: Iterable[IndexRow]) -> pa.Table:
    """Columns of the index, in the order of the rows."""
    return pa.Table.from_pylist([row_record(row) for row in rows], schema=SCHEMA)


def write_index(path: Path, table: pa.Table) -> None:
    """Write the index atomically; equal rows and an equal pyarrow give equal bytes."""
    texts = {*UNIQUE_COLUMNS, *REPEATED_COLUMNS}
    with atomic_file(path) as file:
        pq.write_table(
            table.combine_chunks(),
            file,
            write_page_checksum=True,
            row_group_size=_ROW_GROUP_ROWS,
            compression={name: "zstd" if name in texts else "none" for name in SCHEMA.names},
            use_dictionary=list(REPEATED_COLUMNS),
            column_encoding=dict.fromkeys((*COUNT_COLUMNS, *PLACE_COLUMNS), "DELTA_BINARY_PACKED"),
        )


@dataclass(frozen=True, eq=False)
class IndexTable:
    """The index in memory, column by column.

    Attributes:
        table: a pyarrow table with the columns of `SCHEMA`.
    """

    table: pa.Table

    def __len__(self) -> int:
        return int(self.table.num_rows)

    def texts(self, column: str) -> list[str]:
        """A text column, such as `key`, in the order of the shards."""
        return list(self.table[column].to_pylist())

    def numbers(self, column: str) -> np.ndarray:
        """An integer column as an array [rows]."""
        return np.asarray(self.table[column].to_numpy())

    def codes(self, column: str) -> tuple[np.ndarray, tuple[str, ...]]:
        """A repeated text column as numbers into its distinct values: int32 [rows], and the values."""
        column_of_one = self.table[column].combine_chunks()
        values = column_of_one.dictionary if len(column_of_one) else pa.array([], pa.string())
        codes = column_of_one.indices if len(column_of_one) else pa.array([], pa.int32())
        return np.asarray(codes.to_numpy()), tuple(values.to_pylist())

    def texts_at(self, column: str, rows: np.ndarray) -> list[str]:
        """Values of a text column in some rows, in the order of `rows`."""
        return list(self.table[column].take(pa.array(rows)).to_pylist())

    def counts(self, column: str) -> dict[str, int]:
        """How many clips have each value of a text column, sorted by value."""
        counted = pc.value_counts(self.table[column].combine_chunks().cast(pa.string()))
        return dict(sorted((str(item["values"]), int(item["counts"])) for item in counted.to_pylist()))

    def row_at(self, number: int) -> IndexRow:
        """The clip in row `number`.

        Raises:
            IntegrityError: the row contradicts itself.
        """
        return parse_row(self.table.slice(number, 1).to_pylist()[0])

    def row(self, key: str) -> IndexRow:
        """The clip with this key.

        Raises:
            ConfigError: there is no such clip.
            IntegrityError: the row contradicts itself.
        """
        place = self._find(key)
        if place is None:
            raise ConfigError(f"the release has no clip {key!r}; `wsm inspect RELEASE` lists what it has")
        return self.row_at(place)

    def rows_of_shard(self, shard: str) -> Iterator[IndexRow]:
        """The clips of a shard, in the order in which they stand in it.

        Raises:
            IntegrityError: a row contradicts itself.
        """
        rows = self.table.filter(pc.equal(self.table["shard"], shard)).sort_by("clip_offset")
        for record in rows.to_pylist():
            yield parse_row(record)

    @cached_property
    def _order(self) -> np.ndarray:
        return np.asarray(pc.sort_indices(self.table["key"]))

    def _find(self, key: str) -> int | None:
        column, order = self.table["key"], self._order
        place = bisect_left(order, key, key=lambda number: column[int(number)].as_py())
        found = place < len(order) and column[int(order[place])].as_py() == key
        return int(order[place]) if found else None


def parse_index(data: bytes, where: str) -> IndexTable:
    """Read an index from the bytes of its file.

    Args:
        data: content of an index.parquet.
        where: its place, for messages.

    Raises:
        IntegrityError: it is not an index of this version.
    """
    try:
        file = pq.ParquetFile(pa.BufferReader(data), page_checksum_verification=True)
        metadata = file.schema_arrow.metadata or {}
        if metadata.get(b"wsm.index_version") != INDEX_VERSION.encode():
            raise ValueError(f"wsm.index_version must be {INDEX_VERSION}; use a matching wsm")
        table = file.read()
        if table.schema != SCHEMA:
            raise ValueError(f"its columns must be those of docs/format.md, found {table.schema.names}")
    except (pa.ArrowException, OSError, ValueError) as error:
        raise IntegrityError(f"{where} must be the index of a release, but: {error}; restore the file") from error
    return IndexTable(table)
