import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.clip import MEMBERS
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import IndexTable, index_table, parse_index, write_index
from wsm_data.shards.names import INDEX_NAME


def read_index(folder: Path) -> IndexTable:
    return parse_index((folder / INDEX_NAME).read_bytes(), "index")


@pytest.fixture
def index(tiny: SimpleNamespace) -> IndexTable:
    return read_index(tiny.folder)


def test_rows_stand_in_the_order_of_the_shards(index: IndexTable) -> None:
    rows = [index.row_at(number) for number in range(len(index))]
    assert rows == sorted(rows, key=lambda row: (row.shard, row.clip_offset))
    assert [row.position for row in rows if row.shard == rows[0].shard] == list(
        range(index.counts("shard")[rows[0].shard])
    )


def test_every_clip_is_found_by_its_key(index: IndexTable, tiny: SimpleNamespace) -> None:
    for clip in tiny.clips:
        row = index.row(clip.meta.key)
        assert (row.key, row.frames, row.source_digest) == (clip.meta.key, clip.frame_count, clip.meta.source_digest)


def test_rows_are_found_by_many_keys_at_once(index: IndexTable) -> None:
    keys = index.texts("key")
    wanted = [keys[5], "no/such/clip", keys[0], keys[3]]
    np.testing.assert_array_equal(index.rows_of(wanted), [5, -1, 0, 3])
    np.testing.assert_array_equal(index.rows_of(pa.array(wanted)), [5, -1, 0, 3])
    assert index.rows_of([]).tolist() == []


def test_a_row_that_is_not_there_is_no_row(index: IndexTable) -> None:
    for number in (-1, len(index)):
        with pytest.raises(IndexError, match=f"rows {number} to {number} of an index of 7 rows"):
            index.row_at(number)


@pytest.mark.parametrize("key", ["", "a", "synth_d435i/home_0001/00000", "zzz"])
def test_a_key_that_is_not_there_is_a_wrong_request(index: IndexTable, key: str) -> None:
    with pytest.raises(ConfigError, match="the release has no clip"):
        index.row(key)


def test_the_rows_of_a_shard_are_its_clips_by_offset(index: IndexTable, tiny: SimpleNamespace) -> None:
    seen = []
    for shard in tiny.manifest.shards:
        rows = list(index.rows_of_shard(shard.name))
        assert len(rows) == shard.clips
        assert [row.clip_offset for row in rows] == np.cumsum([0, *(row.clip_size for row in rows)])[:-1].tolist()
        seen += [row.key for row in rows]
    assert sorted(seen) == sorted(clip.meta.key for clip in tiny.clips)


def test_flat_columns_are_enough_to_read_an_array(index: IndexTable, tiny: SimpleNamespace) -> None:
    clip = tiny.clips[0]
    [row] = [row for row in index.columns(SCHEMA.names).to_pylist() if row["key"] == clip.meta.key]
    layout = json.loads(index.columns(SCHEMA.names).schema.metadata[b"wsm.members"])
    data = (tiny.folder / row["shard"]).read_bytes()
    for name in MEMBERS:
        start, size = row[f"{name}_offset"], row[f"{name}_size"]
        shape = [row.get(axis) or int(axis) for axis in layout[name]["shape"]]
        array = np.frombuffer(data[start : start + size], layout[name]["dtype"]).reshape(shape)
        np.testing.assert_array_equal(array, clip.arrays()[name])
        assert start % 64 == 0


def test_some_columns_can_be_read_alone(tiny: SimpleNamespace) -> None:
    table = pq.read_table(tiny.folder / INDEX_NAME, columns=["key", "rgb_latent_offset"])  # as docs/format.md does
    assert table.schema.names == ["key", "rgb_latent_offset"]
    assert table["rgb_latent_offset"].to_numpy().dtype == np.int64


def test_equal_rows_give_equal_bytes(index: IndexTable, tiny: SimpleNamespace, tmp_path: Path) -> None:
    rows = [index.row_at(number) for number in range(len(index))]
    write_index(tmp_path / "one", index_table(rows))
    write_index(tmp_path / "two", index_table(rows))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_an_empty_index_is_an_index(tmp_path: Path) -> None:
    write_index(tmp_path / INDEX_NAME, index_table([]))
    index = read_index(tmp_path)
    assert (len(index), index.counts("split"), index.texts("key")) == (0, {}, [])


def test_other_parquet_files_are_refused(tmp_path: Path, tiny: SimpleNamespace) -> None:
    pq.write_table(SCHEMA.empty_table().replace_schema_metadata({"wsm.index_version": "99"}), tmp_path / "index")
    with pytest.raises(IntegrityError, match=r"wsm\.index_version must be 1"):
        parse_index((tmp_path / "index").read_bytes(), "there")
    pq.write_table(SCHEMA.empty_table().drop_columns(["frames"]), tmp_path / "index")
    with pytest.raises(IntegrityError, match="its columns must be"):
        parse_index((tmp_path / "index").read_bytes(), "there")
    with pytest.raises(IntegrityError, match="there must be the index of a release"):
        parse_index(b"nothing", "there")


def test_a_changed_page_is_refused_when_it_is_read(tiny: SimpleNamespace) -> None:
    data = bytearray((tiny.folder / INDEX_NAME).read_bytes())
    chunk = pq.ParquetFile(tiny.folder / INDEX_NAME).metadata.row_group(0).column(0)
    data[chunk.data_page_offset + chunk.total_compressed_size - 3] ^= 1
    with pytest.raises(IntegrityError, match="restore the file"):
        parse_index(bytes(data), "there")
