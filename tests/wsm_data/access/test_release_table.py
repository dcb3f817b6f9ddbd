from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.scores_statement import with_scores_statement


def _write_scores(tiny: SimpleNamespace, keys: list[str], digest: str) -> None:
    table = pa.table({"key": keys, "path_xy_m": [b"00"] * len(keys), "detour": np.arange(len(keys), dtype=np.float64)})
    schema = with_scores_statement(table.schema, digest, [])
    pq.write_table(table.cast(schema), tiny.folder / SCORES_NAME)


def test_a_row_a_clip_with_plain_texts_in_the_order_of_the_index(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    table = release.to_arrow()
    assert table.column_names == list(SCHEMA.names)
    assert table["key"].to_pylist() == release.index.texts("key")
    assert table.schema.field("split").type == pa.string()


def test_scores_stand_behind_the_columns_of_the_index(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    _write_scores(tiny, release.keys(), release.digest)
    table = release.to_arrow()
    assert table.column_names == [*SCHEMA.names, "detour"]
    assert table["detour"].to_pylist() == list(range(7))


def test_scores_of_other_clips_are_not_joined(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    _write_scores(tiny, release.keys()[::-1], release.digest)
    with pytest.raises(IntegrityError, match="in the order of the index; run `wsm score` again"):
        release.to_arrow()


def test_scores_of_another_release_are_not_joined_though_its_clips_have_the_same_names(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    _write_scores(tiny, release.keys(), "0" * 64)
    with pytest.raises(
        ConfigError, match=f"this release, {release.digest}, found those of 0000.*run `wsm score` again"
    ):
        release.to_arrow()


def test_a_data_frame_is_asked_by_key(tiny: SimpleNamespace) -> None:
    pytest.importorskip("pandas")
    release = open_release(tiny.folder)
    frame = release.to_pandas()
    key = release.keys()[2]
    assert frame.loc[key, "frames"] == release[key].frame_count
    assert frame.groupby("split").size().to_dict() == release.index.counts("split")
