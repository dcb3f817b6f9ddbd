import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import ConfigError
from wsm_data.shards.selection import Selection
from wsm_data.view.browser.clip_query import ClipQuery
from wsm_data.view.browser.clip_table import ClipTable, NumberColumn, TextColumn, clip_table


def a_table(keys, splits, scores) -> ClipTable:
    names = tuple(dict.fromkeys(splits))
    return ClipTable(
        keys=pa.chunked_array([pa.array(keys, pa.string())]),
        texts={"split": TextColumn(codes=np.array([names.index(one) for one in splits], np.int32), values=names)},
        numbers={"score": NumberColumn(numbers=np.array(scores, np.float64), unit="m")},
    )


def select(keys) -> Selection:
    count = len(keys)
    return Selection(
        name="hard",
        release_digest="d",
        rule={},
        command="",
        keys=pa.array(keys),
        scores=np.zeros(count),
        why=pa.array([f"why {key}" for key in keys]),
    )


TABLE = a_table(["b", "c", "A", "d"], ["train", "test", "train", "train"], [2.0, np.nan, 1.0, 2.0])


@pytest.mark.parametrize(
    ("query", "keys"),
    [
        (ClipQuery(), "Abcd"),
        (ClipQuery(descending=True), "dcbA"),
        (ClipQuery(text="a"), "A"),
        (ClipQuery(words={"split": "train"}), "Abd"),
        (ClipQuery(least={"score": 2.0}), "bd"),
        (ClipQuery(most={"score": 1.5}), "A"),
        (ClipQuery(sort="score"), "Abdc"),
        (ClipQuery(sort="score", descending=True), "bdAc"),
        (ClipQuery(sort="split"), "cAbd"),
    ],
)
def test_clips_are_filtered_and_sorted_equal_ones_by_key_and_what_has_no_number_last(query, keys):
    assert [TABLE.keys[row].as_py() for row in TABLE.rows(query).tolist()] == list(keys)


def test_a_selection_keeps_its_clips_and_sorts_by_rank():
    chosen = select(["d", "A"])
    rows = TABLE.rows(ClipQuery(sort="rank"), chosen).tolist()
    assert [TABLE.keys[row].as_py() for row in rows] == ["d", "A"]
    assert TABLE.ranks(chosen).tolist()[3] == 1.0


@pytest.mark.parametrize(
    ("query", "message"),
    [
        (ClipQuery(sort="scoer"), "did you mean score"),
        (ClipQuery(sort="rank"), "no column 'rank'"),
        (ClipQuery(least={"splt": 1.0}), "no column 'splt'"),
        (ClipQuery(words={"split": "tran"}), "no value 'tran' in the column split; did you mean train"),
    ],
)
def test_a_wrong_name_is_refused_with_the_nearest_one(query, message):
    with pytest.raises(ConfigError, match=message):
        TABLE.rows(query)


numbers = st.lists(st.one_of(st.just(float("nan")), st.integers(-3, 3).map(float)), min_size=1, max_size=20)


@given(numbers, st.integers(-3, 3), st.booleans())
def test_a_limit_and_an_order_are_those_of_a_slow_and_obvious_loop(scores, least, descending):
    keys = [f"{number * 7 % 20:02d}-{number}" for number in range(len(scores))]
    table = a_table(keys, ["train"] * len(keys), scores)
    found = table.rows(ClipQuery(least={"score": float(least)}, sort="score", descending=descending))
    kept = [(score, key) for score, key in zip(scores, keys, strict=True) if score >= least]
    sign = -1 if descending else 1
    assert [keys[row] for row in found.tolist()] == [
        key for _, key in sorted(kept, key=lambda one: (sign * one[0], one[1]))
    ]


def test_a_record_has_null_where_a_clip_has_no_number():
    assert TABLE.records([1]) == [{"key": "c", "split": "test", "score": None}]


def test_columns_say_their_values_and_ranges():
    text, number = TABLE.columns
    assert text == {"name": "split", "kind": "text", "values": [("test", 1), ("train", 3)]}
    assert (number["least"], number["most"], number["unit"]) == (1.0, 2.0, "m")


def test_the_table_of_a_release_has_its_scores_with_unit_meaning_and_hard_end(selected):
    table, notice = clip_table(selected.release)
    assert notice == ""
    assert len(table) == len(selected.release)
    detour = table.numbers["detour_ratio"]
    assert (detour.unit, detour.summary, detour.hard) == (
        "ratio",
        "invented <b>bold</b> detour_ratio",
        "higher is harder",
    )
    assert detour.numbers.tolist() == np.linspace(1.0, 3.0, 6).tolist()


def test_a_release_without_scores_is_shown_without_them(release):
    table, notice = clip_table(release)
    assert (list(table.numbers), notice) == (["frames", "padded_frames"], "")
