import io

import pyarrow.parquet as pq
import pytest

from wsm_data.clips.lerobot.meta import RGB_VIDEO, features, row_schema, tasks_table


def test_rows_have_a_column_for_each_feature_that_is_no_video():
    said = features((32, 16), 7, None)
    assert [name for name, one in said.items() if one["dtype"] != "video"] == row_schema().names
    assert said[RGB_VIDEO]["shape"] == [16, 32, 3]


def test_pandas_takes_the_task_for_the_index():
    pd = pytest.importorskip("pandas", reason="the extra notebook is not installed")
    buffer = io.BytesIO()
    pq.write_table(tasks_table("walk"), buffer)
    found = pd.read_parquet(io.BytesIO(buffer.getvalue()))
    assert found.index.tolist() == ["walk"]
    assert found["task_index"].tolist() == [0]
