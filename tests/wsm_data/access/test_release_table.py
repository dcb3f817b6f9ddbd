from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.access.release import open_release
from wsm_data.errors import IntegrityError
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.names import SCORES_NAME


def _write_scores(tiny: SimpleNamespace, keys: list[str]) -> None:
    table = pa.table({"key": keys, "path_xy_m": [b"00"] * len(keys), "detour": np.arange(len(keys), dtype=np.float64)})
    pq.write_table(table, tiny.folder / SCORES_NAME)


def test_a_row_a_clip_with_plain_texts_in_the_order_of_the_index(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    table = release.to_arrow()
    assert table.column_names == list(SCHEMA.names)
    assert table["key"].to_pylist() == release.index.texts("key")
    assert table.schema.field("split").type == pa.string()


def test_scores_stand_behind_the_columns_of_the_index(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    _write_scores(tiny, release.keys())
    table = release.to_arrow()
    assert table.column_names == [*SCHEMA.names, "detour"]
    assert table["detour"].to_pylist() == list(range(7))


def test_scores_of_other_clips_are_not_joined(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    _write_scores(tiny, release.keys()[::-1])
    with pytest.raises(IntegrityError, match="in the order of the index; run `wsm score` again"):
        release.to_arrow()


def test_a_data_frame_is_asked_by_key(tiny: SimpleNamespace) -> None:
    pytest.importorskip("pandas")
    release = open_release(tiny.folder)
    frame = release.to_pandas()
    key = release.keys()[2]
    assert frame.loc[key, "frames"] == release[key].frame_count
    assert frame.groupby("split").size().to_dict() == release.index.counts("split")
