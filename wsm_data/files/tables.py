"""Tables in parquet files: equal tables give equal bytes, and what is read is compared with checksums and columns.

A file may say what it is in its metadata: under a name such as `wsm.scores` stands a JSON object with a `version`.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import atomic_file
from wsm_data.files.differences import differences
from wsm_data.files.jsonlines import canonical_json


def write_table(path: Path, table: pa.Table, **storage: Any) -> None:
    """Write a table atomically, each page with a checksum; equal tables and an equal pyarrow give equal bytes.

    Args:
        path: where to.
        table: its schema carries the metadata.
        storage: how columns are stored, as `pyarrow.parquet.write_table` takes it.
    """
    with atomic_file(path) as file:
        pq.write_table(table, file, write_page_checksum=True, **storage)


@contextmanager
def opened_table(
    open_file: Callable[[], AbstractContextManager[Any]],
    must_be: str,
    remedy: str,
    metadata: pq.FileMetaData | None = None,
) -> Iterator[pq.ParquetFile]:
    """A parquet file whose pages are compared with their checksums when they are read.

    Args:
        open_file: opens it at random access.
        must_be: beginning of a message about the file, such as `x.parquet must be the inventory of a release`.
        remedy: its end: what to do.
        metadata: of this file, where it was read before.

    Raises:
        FileNotFoundError: there is no such file.
        IntegrityError: it is no parquet file, a page is damaged, or the body does not take what stands in it.
    """
    try:
        with open_file() as file, pq.ParquetFile(file, metadata=metadata, page_checksum_verification=True) as parquet:
            yield parquet
    except FileNotFoundError:
        raise
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError) as error:
        raise IntegrityError(f"{must_be}, but: {error}; {remedy}") from error


def with_statement(schema: pa.Schema, name: str, statement: Mapping[str, Any]) -> pa.Schema:
    """The columns with an object of JSON values in the metadata, `version` among them."""
    return schema.with_metadata({name: canonical_json(statement)})


def read_statement(schema: pa.Schema, name: str, version: int) -> dict[str, Any]:
    """What `with_statement` put into the metadata.

    Raises:
        ValueError: there is nothing of that name, or of another version.
    """
    statement = json.loads((schema.metadata or {}).get(name.encode(), b"{}"))
    found = statement.get("version") if isinstance(statement, dict) else statement
    if found != version:
        raise ValueError(f"{name} in its metadata must say version {version}, found {found!r}; use a matching wsm")
    return dict(statement)


def require_columns(found: pa.Schema, wanted: pa.Schema) -> None:
    """Check names, types and order of columns.

    Raises:
        ValueError: says in which columns they differ.
    """
    if not found.equals(wanted):
        changed = differences(_types(found), _types(wanted)) or [f"their order, found {found.names}"]
        raise ValueError(f"its columns must be those of this version; found -> wanted: {'; '.join(changed)}")


def read_full(file: pq.ParquetFile, wanted: pa.Schema) -> pa.Table:
    """All of a table of these columns in which no value is missing.

    Raises:
        ValueError: the columns are others, or a value is missing.
    """
    require_columns(file.schema_arrow, wanted)
    table = file.read()
    for name in table.column_names:
        if table[name].null_count:
            raise ValueError(f"every row must have a value of {name}, {table[name].null_count} have none")
    return table


def _types(schema: pa.Schema) -> dict[str, str]:
    return {field.name: f"{field.type}{'' if field.nullable else ', never missing'}" for field in schema}
