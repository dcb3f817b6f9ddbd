from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import IntegrityError
from wsm_data.files.tables import opened_table, read_full, read_statement, require_columns, with_statement, write_table

SCHEMA = pa.schema([("key", pa.string()), ("width_m", pa.float64())])
TABLE = pa.table({"key": ["a", "b"], "width_m": [1.5, None]}, schema=with_statement(SCHEMA, "wsm.x", {"version": 2}))


def read(path: Path, schema: pa.Schema = SCHEMA) -> pa.Table:
    with opened_table(partial(path.open, "rb"), f"{path.name} must be a table of widths", "measure again") as file:
        read_statement(file.schema_arrow, "wsm.x", 2)
        require_columns(file.schema_arrow, schema)
        return file.read()


def test_a_table_comes_back_equal_and_equal_tables_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_table(tmp_path / name, TABLE, compression="zstd")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    assert read(tmp_path / "one").equals(TABLE, check_metadata=True)


def test_what_is_no_table_or_cut_short_or_lies_in_a_page_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "t"
    write_table(path, TABLE, compression="none", use_dictionary=False, write_statistics=False)
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[whole.index(pa.array([1.5]).buffers()[1].to_pybytes())] ^= 1  # in the page of the widths
    for damaged in (b"", b"text", whole[:-20], bytes(flipped)):
        path.write_bytes(damaged)
        with pytest.raises(IntegrityError, match=r"^t must be a table of widths, but: .*; measure again$"):
            read(path)


def test_a_missing_file_is_for_the_caller_to_explain(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "t")


@pytest.mark.parametrize("metadata", [None, {"wsm.x": "3"}, {"wsm.x": "{"}, {"wsm.x": '{"version": 3}'}])
def test_another_version_or_none_is_refused(tmp_path: Path, metadata: dict[str, str] | None) -> None:
    write_table(tmp_path / "t", TABLE.replace_schema_metadata(metadata))
    with pytest.raises(IntegrityError, match="t must be a table of widths"):
        read(tmp_path / "t")


def test_columns_are_compared_by_name_type_order_and_whether_they_may_be_missing() -> None:
    key, width = SCHEMA
    for found, words in (
        ([key], r'width_m: absent -> "double"'),
        ([key, width.with_type(pa.float32())], r'width_m: "float" -> "double"'),
        ([key, width.with_nullable(False)], r'width_m: "double, never missing" -> "double"'),
        ([width, key], r"their order, found \['width_m', 'key'\]"),
    ):
        with pytest.raises(ValueError, match=words):
            require_columns(pa.schema(found), SCHEMA)
    require_columns(TABLE.schema, SCHEMA)


def test_a_full_table_misses_no_value(tmp_path: Path) -> None:
    write_table(tmp_path / "t", TABLE)
    with pq.ParquetFile(tmp_path / "t") as file, pytest.raises(ValueError, match="a value of width_m, 1 have none"):
        read_full(file, SCHEMA)
    write_table(tmp_path / "t", TABLE.slice(0, 1))
    with pq.ParquetFile(tmp_path / "t") as file:
        assert read_full(file, SCHEMA).to_pylist() == [{"key": "a", "width_m": 1.5}]
