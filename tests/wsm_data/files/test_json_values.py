"""Dataclasses as JSON and back: to the bit, and nothing missing, unknown or of another type is taken."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.files.json_values import from_json, load_json, load_json_lines, to_json


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Point:
    x_m: float
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Value:
    points: tuple[Point, ...]
    pair: tuple[int, float]
    rows: tuple[tuple[float, ...], ...] = ()
    colour: Colour = Colour.RED
    parent: str | None = None
    where: Path = Path("a/b")
    words: Mapping[str, object] = field(default_factory=dict)


VALUE = Value(
    points=(Point(0.1), Point(2.0, "b")), pair=(3, 0.25), rows=((1.0, 2.0), ()), words={"n": [1, {"m": None}]}
)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


def test_all_parts_become_json_values():
    assert to_json(VALUE) == {
        "points": [{"x_m": 0.1, "name": ""}, {"x_m": 2.0, "name": "b"}],
        "pair": [3, 0.25],
        "rows": [[1.0, 2.0], []],
        "colour": "red",
        "parent": None,
        "where": "a/b",
        "words": {"n": [1, {"m": None}]},
    }


@given(
    st.lists(st.builds(Point, FLOATS, st.text()), max_size=3), FLOATS, st.none() | st.just("a"), st.sampled_from(Colour)
)
def test_a_value_comes_back_equal_to_the_bit(points, number, parent, colour):
    value = Value(points=tuple(points), pair=(1, number), parent=parent, colour=colour, rows=((number,),))
    again = from_json(Value, json.loads(json.dumps(to_json(value))))
    assert again == value
    assert again.pair[1].hex() == number.hex()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"colour": "green"}, "colour must be one of red, blue, found 'green'"),
        ({"points": [{"x_m": "far", "name": ""}]}, "points.x_m takes a number, found 'far'"),
        ({"points": [{"x_m": 1.0}]}, r"fields of Value, differing: points\[0\].name: absent -> \"\""),
        ({"points": [{"x_m": 1.0, "name": "", "y": 2}]}, "unknown key points.y"),
        ({"pair": [True, 0.5]}, "pair takes a whole number, found True"),
        ({"pair": [1]}, "pair takes 2 values, found 1"),
        ({"rows": None}, "rows takes a list"),
        ({"more": 1}, "unknown key more"),
        ({"words": []}, "words is a section"),
    ],
)
def test_what_is_not_of_the_kind_is_refused_with_the_field(change, said):
    with pytest.raises(ValueError, match=said):
        from_json(Value, {**to_json(VALUE), **change})


@pytest.mark.parametrize("name", ["points", "colour", "words"])
def test_a_field_that_is_missing_is_refused_though_it_has_a_default(name):
    record = to_json(VALUE)
    del record[name]
    with pytest.raises(ValueError, match=name):
        from_json(Value, record)


@pytest.mark.parametrize("record", [None, [], "text"])
def test_what_is_no_object_is_refused(record):
    with pytest.raises(ValueError, match="must be an object of Value"):
        from_json(Value, record)


def test_a_field_with_a_default_may_be_missing_only_where_that_is_asked_for():
    assert from_json(Point, {"x_m": 0.5}, complete=False) == Point(0.5)
    with pytest.raises(ValueError, match='name: absent -> ""'):
        from_json(Point, {"x_m": 0.5})


@pytest.mark.parametrize("content", [None, "", "[]", '{"name": "a"}', '{"x_m": "a"}'])
def test_a_file_that_is_missing_or_holds_something_else_is_damaged(tmp_path, content):
    path = tmp_path / "point.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(IntegrityError, match=r"point\.json must hold a point, but: .*; write it again"):
        load_json(Point, path, "a point", "write it again")
    path.write_text('{"x_m": 0.5}')
    assert load_json(Point, path, "a point", "write it again") == Point(0.5)


def test_lines_are_read_one_by_one_and_a_wrong_one_is_named(tmp_path):
    path = tmp_path / "points.jsonl"
    assert list(load_json_lines(Point, path, "a point", "write it again")) == []
    path.write_text('{"x_m": 0.5}\n{"x_m": 1.5, "name": "b"}\n{"y_m": 2.5}\n')
    points = load_json_lines(Point, path, "a point", "write it again")
    assert [next(points), next(points)] == [Point(0.5), Point(1.5, "b")]
    with pytest.raises(IntegrityError, match=r"points\.jsonl:3 must hold a point, but: .*y_m.*; write it again"):
        next(points)
