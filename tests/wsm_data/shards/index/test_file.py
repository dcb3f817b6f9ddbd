from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import IntegrityError
from wsm_data.shards.index.file import IndexFile, local_file
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import IndexTable, write_index
from wsm_data.shards.names import INDEX_NAME


@pytest.fixture
def path(tiny: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The index of the seven clips in groups of two rows, of which each is kept alone."""
    monkeypatch.setattr("wsm_data.shards.index.table._ROW_GROUP_ROWS", 2)
    monkeypatch.setattr("wsm_data.shards.row_blocks._BLOCK_ROWS", 2)
    path = tmp_path / "small_groups.parquet"
    write_index(path, pq.read_table(tiny.folder / INDEX_NAME, schema=SCHEMA))
    return path


def open_it(path: Path) -> IndexFile:
    return IndexFile(partial(pa.OSFile, str(path)), str(path))


def damage(path: Path, column: str, group: int) -> None:
    chunk = pq.read_metadata(path).row_group(group).column(SCHEMA.get_field_index(column))
    data = bytearray(path.read_bytes())
    data[chunk.data_page_offset + chunk.total_compressed_size - 3] ^= 1
    path.write_bytes(data)


def test_groups_of_rows_give_what_the_whole_table_gives(path: Path) -> None:
    assert pq.read_metadata(path).num_row_groups == 4
    lazy, whole = IndexTable(open_it(path)), IndexTable(pq.read_table(path, schema=SCHEMA))
    assert len(lazy) == len(whole) == 7
    for row in [*range(7), 0, 6, 3]:
        assert lazy.row_at(row) == whole.row_at(row)
    for column in ("split", "shard", "scene"):
        assert lazy.counts(column) == whole.counts(column)
        codes, values = lazy.codes(column)
        assert [values[code] for code in codes] == lazy.texts(column) == whole.texts(column)
    for column in ("latents", "clip_offset", "poses_checksum"):
        np.testing.assert_array_equal(lazy.numbers(column), whole.numbers(column))
        assert lazy.numbers(column).dtype == SCHEMA.field(column).type.to_pandas_dtype()
    for rows in ([4, 1, 4, 0], []):
        both = [index.values(["key", "shard", "latents"], np.array(rows)) for index in (lazy, whole)]
        assert [values.tolist() for values in both[0]] == [values.tolist() for values in both[1]]
        assert both[0][0].tolist() == [whole.texts("key")[row] for row in rows]
    for shard in whole.counts("shard"):
        assert list(lazy.rows_of_shard(shard)) == list(whole.rows_of_shard(shard))


def test_columns_and_groups_are_read_alone(path: Path) -> None:
    damage(path, "poses_checksum", group=1)  # rows 2 and 3
    index = IndexTable(open_it(path))
    assert index.row_at(0).key == index.texts("key")[0]
    assert index.row(index.texts("key")[6]).key == index.texts("key")[6]
    with pytest.raises(IntegrityError, match=r"small_groups\.parquet must be the index of a release.*restore the file"):
        index.numbers("poses_checksum")
    with pytest.raises(IntegrityError, match=r"small_groups\.parquet must be the index of a release"):
        index.row_at(2)


def test_bytes_in_memory_are_read_like_a_file(path: Path) -> None:
    index = IndexTable(IndexFile(partial(pa.BufferReader, path.read_bytes()), "there"))
    assert index.row_at(5) == IndexTable(open_it(path)).row_at(5)


def test_an_index_of_no_rows_has_none(tmp_path: Path) -> None:
    write_index(tmp_path / INDEX_NAME, SCHEMA.empty_table())
    index = IndexTable(open_it(tmp_path / INDEX_NAME))
    assert (len(index), index.texts("key"), index.counts("split")) == (0, [], {})
    assert index.codes("shard")[1] == ()
    with pytest.raises(IndexError):
        index.row_at(0)


def test_no_file_is_open_between_two_reads(path: Path) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    index = IndexTable(open_it(path))
    index.row_at(3)
    index.numbers("latents")
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_a_file_is_opened_again_only_as_it_was(path: Path, tmp_path: Path) -> None:
    with local_file(str(path)) as (file, open_again):
        assert file.read() == path.read_bytes()
    with open_again() as again:
        assert again.read() == path.read_bytes()
    kept = path.rename(tmp_path / "kept")
    with pytest.raises(IntegrityError, match="is missing since the release was opened; fetch it again"):
        open_again()
    path.write_bytes(kept.read_bytes())
    with pytest.raises(IntegrityError, match="was changed since the release was opened; open the release again"):
        open_again()
    with pytest.raises(FileNotFoundError), local_file(str(tmp_path / "nowhere")):
        pass


def test_more_rows_than_the_file_has_room_for_are_refused_before_any_is_read(
    tiny: SimpleNamespace, tmp_path: Path
) -> None:
    """A million rows alike take 100 KB by run lengths; read, they would take 460 MB. Checksums are 64 bytes a row."""
    one = pq.read_table(tiny.folder / INDEX_NAME, schema=SCHEMA).slice(0, 1)
    path = tmp_path / "bomb.parquet"
    pq.write_table(one.take(pa.array(np.zeros(1_000_000, np.int64))), path, compression="zstd")
    most = path.stat().st_size // 64
    with pytest.raises(IntegrityError, match=f"at most {most} rows, and declares 1000000"):
        open_it(path)
