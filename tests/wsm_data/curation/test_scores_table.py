import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.scores_table import (
    Direction,
    ScorerInfo,
    ScoreTable,
    key_differences,
    read_paths,
    read_scorers,
    read_scores,
    write_scores,
)
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.sealed import SEAL, sealed

WIDTH = ScorerInfo(name="width_m", unit="m", direction=Direction.LOWER, summary="how wide")
COST = ScorerInfo(
    name="cost", unit="ratio", direction=Direction.HIGHER, summary="what it costs", version=3, absent="unpaid"
)
NAN, INF = float("nan"), float("inf")


@pytest.fixture
def table():
    return ScoreTable(
        release_digest="d1",
        scorers=(WIDTH, COST),
        keys=pa.array(["g/s/0", "g/s/1", "g/s/2"]),
        columns={"width_m": np.array([0.1, 2.0, 1e-300]), "cost": np.array([5.0, NAN, -0.0])},
    )


@pytest.fixture
def outlines():
    rng = np.random.default_rng(0)
    return Outlines(
        xy_m=rng.normal(size=(3, 32, 2)).astype(np.float32), floor_z_m=rng.normal(size=3).astype(np.float32)
    )


@pytest.fixture
def file(tmp_path, table, outlines):
    path = tmp_path / "scores.parquet"
    write_scores(path, table, outlines)
    return path


def test_what_is_written_is_read_to_the_bit_absent_values_included(file, table):
    found = read_scores(file, release_digest="d1", release_keys=pa.chunked_array([["g/s/0", "g/s/1"], ["g/s/2"]]))
    assert (found.release_digest, found.scorers) == ("d1", table.scorers)
    assert found.keys.equals(table.keys)
    assert all(found.columns[name].tobytes() == table.columns[name].tobytes() for name in ("width_m",))
    assert np.array_equal(found.columns["cost"], table.columns["cost"], equal_nan=True)
    assert len(found) == 3


def test_equal_tables_give_equal_bytes(file, table, outlines, tmp_path):
    other = tmp_path / "again.parquet"
    write_scores(
        other, replace(table, keys=pa.concat_arrays([table.keys[:1], table.keys[1:]])), outlines.take(np.arange(3))
    )
    assert other.read_bytes() == file.read_bytes()


def test_only_the_scores_that_are_asked_for_are_read_and_an_unknown_one_is_named(file):
    assert list(read_scores(file, release_digest="d1", only=["cost"]).columns) == ["cost"]
    assert [one.name for one in read_scorers(file)] == ["width_m", "cost"]
    with pytest.raises(ConfigError, match="no score 'widht_m'; did you mean width_m"):
        read_scores(file, release_digest="d1", only=["widht_m"])


def test_outlines_of_some_clips_are_read_in_any_order_with_their_floors(file, outlines):
    rows = np.array([2, 0, 2])
    found = read_paths(file, rows)
    assert np.array_equal(found.xy_m, outlines.xy_m[rows])
    assert np.array_equal(found.floor_z_m, outlines.floor_z_m[rows])
    assert read_paths(file, rows[:0]).xy_m.shape == (0, 32, 2)


def test_outlines_are_read_across_the_groups_in_which_they_are_stored(file, table, outlines, monkeypatch):
    monkeypatch.setattr("wsm_data.curation.scores_table._ROW_GROUP_ROWS", 2)
    write_scores(file, table, outlines)
    assert np.array_equal(read_paths(file, np.array([2, 1, 0])).xy_m, outlines.xy_m[::-1])


def test_an_outline_is_stored_as_its_numbers_one_after_the_other(file, outlines):
    stored = pq.read_table(file)["path_xy_m"].to_pylist()
    assert stored[1] == outlines.xy_m[1].astype("<f4").tobytes()


@pytest.mark.parametrize("column", ["path_xy_m", "floor_z_m"])
def test_a_clip_without_an_outline_or_a_floor_is_damage(file, column):
    stored = pq.read_table(file)
    rewritten(file, **{column: pa.array([*stored[column].to_pylist()[:2], None], stored.schema.field(column).type)})
    with pytest.raises(IntegrityError, match="every clip must have an outline and a floor"):
        read_paths(file, np.arange(3))


def test_a_path_or_a_floor_that_is_no_number_is_a_bug_of_the_caller(tmp_path, table, outlines):
    for name in ("xy_m", "floor_z_m"):
        bad = getattr(outlines, name).copy()
        bad[1] = NAN
        with pytest.raises(ValueError, match=f"{name} must be finite"):
            write_scores(tmp_path / "bad.parquet", table, replace(outlines, **{name: bad}))


def test_another_release_is_refused_with_both_digests_and_the_clips_that_differ(file):
    with pytest.raises(ConfigError, match="d1 -> d2"):
        read_scores(file, release_digest="d2")
    keys = pa.chunked_array([["g/s/1", "g/s/2", "g/s/9", "g/s/8"]])
    with pytest.raises(ConfigError) as error:
        read_scores(file, release_digest="d2", release_keys=keys)
    for line in ("clips: 3 -> 4", "gone: 1, such as g/s/0", "added: 2, such as g/s/9, g/s/8"):
        assert line in str(error.value)


def test_a_missing_clip_is_named_also_where_the_digest_is_right(file):
    keys = pa.chunked_array([["g/s/0", "g/s/1", "g/s/2", "g/s/3"]])
    with pytest.raises(ConfigError, match="added: 1, such as g/s/3"):
        read_scores(file, release_digest="d1", release_keys=keys)


def test_a_difference_of_nothing_but_the_digest_says_so():
    keys = pa.chunked_array([["a", "b"]])
    assert key_differences(keys, keys) == ["  clips: 2 -> 2", "  the clips are the same"]


@pytest.mark.parametrize(
    ("name", "values", "found"),
    [("width_m", [0.1, NAN, 2.0], "no value"), ("width_m", [0.1, INF, 2.0], "inf"), ("cost", [0.1, -INF, 2.0], "-inf")],
)
def test_a_value_that_is_no_number_is_not_written_and_names_score_and_clip(
    tmp_path, table, outlines, name, values, found
):
    bad = replace(table, columns={**table.columns, name: np.array(values)})
    with pytest.raises(ConfigError, match=f"{name} of clip g/s/1 must be a number, found {found}; 1 clips"):
        write_scores(tmp_path / "bad.parquet", bad, outlines)
    assert list(tmp_path.glob("*bad*")) == []


def rewritten(file, **columns):
    """The file with other columns and the same metadata."""
    stored = pq.read_table(file)
    for name, values in columns.items():
        stored = stored.set_column(stored.column_names.index(name), stored.schema.field(name), pa.array(values))
    pq.write_table(stored, file)
    return file


def test_a_stored_nan_is_refused_even_where_a_value_may_be_absent(file):
    with pytest.raises(ConfigError, match="cost of clip g/s/2 must be a number, found NaN"):
        read_scores(rewritten(file, cost=[1.0, None, NAN]), release_digest="d1")


def test_a_null_where_every_clip_has_a_value_is_refused(file):
    with pytest.raises(ConfigError, match="width_m of clip g/s/1 must be a number, found no value"):
        read_scores(rewritten(file, width_m=[1.0, None, 2.0]), release_digest="d1")


def test_a_file_that_is_not_there_says_what_to_run(tmp_path):
    with pytest.raises(ConfigError, match="wsm score RELEASE"):
        read_scores(tmp_path / "none.parquet", release_digest="d1")


def test_damage_is_told_from_a_wrong_request(file, tmp_path):
    data = file.read_bytes()
    for damaged in (b"", data[:-20], data[: len(data) // 2]):
        file.write_bytes(damaged)
        with pytest.raises(IntegrityError, match="must be a table of scores"):
            read_scores(file, release_digest="d1")
    other = tmp_path / "other.parquet"
    pq.write_table(pa.table({"key": ["a"]}), other)
    with pytest.raises(IntegrityError, match="must say version 3, found None"):
        read_scores(other, release_digest="d1")


def test_a_changed_byte_of_a_value_is_noticed(file, table):
    data = bytearray(file.read_bytes())
    place = data.find(table.columns["width_m"].tobytes()[:16])
    data[place + 3] ^= 1
    file.write_bytes(bytes(data))
    with pytest.raises(IntegrityError):
        read_scores(file, release_digest="d1")


def test_columns_that_are_not_those_the_file_speaks_of_are_refused(file):
    stored = pq.read_table(file)
    pq.write_table(stored.drop_columns(["cost"]), file)
    with pytest.raises(IntegrityError, match="its columns must be"):
        read_scores(file, release_digest="d1")
    record = json.loads(stored.schema.metadata[b"wsm.scores"])
    record["scorers"][0]["direction"] = "lower is harder, they say"
    pq.write_table(stored.replace_schema_metadata({b"wsm.scores": json.dumps(record)}), file)
    with pytest.raises(IntegrityError, match="it was changed since it was written"):
        read_scores(file, release_digest="d1")
    record["scorers"][0]["direction"] = "sideways"
    resealed = sealed({name: value for name, value in record.items() if name != SEAL})
    pq.write_table(stored.replace_schema_metadata({b"wsm.scores": json.dumps(resealed)}), file)
    with pytest.raises(IntegrityError, match="sideways"):
        read_scores(file, release_digest="d1")


def test_columns_that_do_not_fit_the_keys_or_the_scorers_are_a_bug_of_the_caller(table):
    for columns in ({"width_m": np.zeros(3)}, {"width_m": np.zeros(2), "cost": np.zeros(3)}):
        with pytest.raises(ValueError, match="must be"):
            replace(table, columns=columns)
    with pytest.raises(ValueError, match="once each"):
        replace(table, scorers=(WIDTH, replace(COST, name="key")), columns={"width_m": np.zeros(3), "key": np.zeros(3)})
