"""From TOML and `--set` to frozen configs: what is taken, what is refused, and what decides the bytes."""

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.config import (
    INPUT,
    SPEED,
    build_config,
    config_json,
    convert,
    differences,
    load_toml,
    merge,
    parse_assignments,
    settings_of,
)
from wsm_data.errors import ConfigError


class Colour(StrEnum):
    RED = "red"
    DARK_BLUE = "dark_blue"


@dataclass(frozen=True, kw_only=True)
class Grid:
    resolution_m: float = 0.05
    cells: tuple[int, int] = (4, 3)
    cache: Path = field(default=Path("cache"), metadata=SPEED)


@dataclass(frozen=True, kw_only=True)
class Config:
    source: Path = field(metadata=INPUT)
    name: str = "a name"
    count: int = 3
    exact: bool = False
    colour: Colour = Colour.RED
    cameras: tuple[str, ...] = ("d435i",)
    limit_m: float | None = None
    grid: Grid = field(default_factory=Grid)

    def __post_init__(self) -> None:
        if self.count < 0:
            raise ValueError(f"count must not be negative, found {self.count}")


def built(*words):
    return build_config(Config, parse_assignments(["source=tree", *words]))


@pytest.mark.parametrize(
    ("word", "field_name", "value"),
    [
        ("count=5", "count", 5),
        ("count = 5", "count", 5),
        ("exact=true", "exact", True),
        ("name=plain words", "name", "plain words"),
        ('name="in quotes"', "name", "in quotes"),
        ("name=a=b", "name", "a=b"),
        ("name=", "name", ""),
        ("colour=dark_blue", "colour", Colour.DARK_BLUE),
        ("source=some/where", "source", Path("some/where")),
        ("source=~/data", "source", Path.home() / "data"),
        ("cameras=zed", "cameras", ("zed",)),
        ('cameras=["zed", "d435i"]', "cameras", ("zed", "d435i")),
        ("cameras=[]", "cameras", ()),
        ("limit_m=2", "limit_m", 2.0),
        ("limit_m=1e-3", "limit_m", 0.001),
        ("limit_m=none", "limit_m", None),
        ("grid.resolution_m=0.1", "grid", Grid(resolution_m=0.1)),
        ("grid.cells=[8, 9]", "grid", Grid(cells=(8, 9))),
    ],
)
def test_a_word_becomes_a_value_of_the_fields_type(word, field_name, value):
    assert getattr(built(word), field_name) == value


@pytest.mark.parametrize("text", ["1.10", "007", "1e3", "2024-10-18", "true", "0x10", "1_000", "[1, 2]", "nan"])
def test_text_that_looks_like_something_else_stays_as_it_was_typed(text):
    assert built(f"name={text}").name == text
    assert built(f"source={text}").source == Path(text)


@given(st.integers(-(10**12), 10**12))
def test_whole_numbers_are_read_back(number):
    assert convert(int, parse_assignments([f"x={number}"])["x"], "x") == number


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_read_back_to_the_bit(number):
    assert convert(float, parse_assignments([f"x={number!r}"])["x"], "x").hex() == number.hex()


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("coutn=5", r"unknown setting coutn; did you mean count\?"),
        ("grid.resolution=1", r"unknown setting grid.resolution; did you mean grid.resolution_m\?"),
        ("qqq=5", "unknown setting qqq; known: cameras, colour, count,"),
        ("count=5.0", "count takes a whole number, found 5.0"),
        ("count=true", "count takes a whole number, found True"),
        ("count=five", "count takes a whole number, found 'five'"),
        ("exact=1", "exact takes true or false, found 1"),
        ("limit_m=true", "limit_m takes a number, found True"),
        ("limit_m=nan", "limit_m must be finite, found nan"),
        ("limit_m=-inf", "limit_m must be finite, found -inf"),
        ("colour=green", "colour must be one of red, dark_blue, found 'green'"),
        ("grid=5", "grid is a section, found the value '5'"),
        ("grid.cells=[1, 2, 3]", "grid.cells takes 2 values, found 3"),
        ("grid.cells=7", "grid.cells takes 2 values, found 1"),
        ("grid.cells=[1, 2.5]", "grid.cells takes a whole number, found 2.5"),
        ("cameras=[1]", "cameras takes text in quotes, found 1"),
        ("count=-1", "configuration: count must not be negative, found -1"),
    ],
)
def test_what_a_field_does_not_take_is_refused_by_name_and_value(word, message):
    with pytest.raises(ConfigError, match=message):
        built(word)


def test_a_number_in_a_file_is_not_turned_into_text():
    with pytest.raises(ConfigError, match=r"name takes text in quotes, found 1.1"):
        build_config(Config, {"source": "tree", "name": 1.10})


def test_what_has_no_default_must_be_given():
    with pytest.raises(ConfigError, match=r"source must be given: use --set source=\.\.\."):
        build_config(Config, {})


@pytest.mark.parametrize("word", ["count", "=5", ".count=5", "grid.=5", "grid..cells=5", ""])
def test_a_word_without_a_key_or_a_value_is_refused(word):
    with pytest.raises(ConfigError, match=r"--set takes key=value or section.key=value"):
        parse_assignments([word])


def test_a_key_cannot_be_a_value_and_a_section():
    with pytest.raises(ConfigError, match="grid was given a value before, it cannot also be a section"):
        parse_assignments(["grid=5", "grid.cells=[1, 2]"])


def test_later_words_win():
    assert built("count=1", "count=2").count == 2


def test_changes_are_laid_over_section_by_section():
    base = {"grid": {"resolution_m": 0.1, "cells": [1, 2]}, "count": 1}
    assert merge(base, {"grid": {"cells": [3, 4]}, "name": "b"}) == {
        "grid": {"resolution_m": 0.1, "cells": [3, 4]},
        "count": 1,
        "name": "b",
    }
    assert base["grid"] == {"resolution_m": 0.1, "cells": [1, 2]}


def test_settings_hold_neither_inputs_nor_speed_at_any_depth():
    assert settings_of(built()) == {
        "name": "a name",
        "count": 3,
        "exact": False,
        "colour": "red",
        "cameras": ["d435i"],
        "limit_m": None,
        "grid": {"resolution_m": 0.05, "cells": [4, 3]},
    }


def test_the_whole_config_holds_everything_and_paths_from_the_root(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = config_json(built())
    assert whole["source"] == str(tmp_path / "tree")
    assert whole["grid"]["cache"] == str(tmp_path / "cache")


def test_differences_name_every_setting_that_changed_with_both_values():
    old = {"a": 1, "grid": {"x": 1, "y": 2}, "gone": None}
    new = {"a": 1, "grid": {"x": 1, "y": 3}, "new": None}
    assert differences(old, new) == ["gone: None -> absent", "grid.y: 2 -> 3", "new: absent -> None"]


def test_a_toml_file_is_read(tmp_path):
    (tmp_path / "a.toml").write_text('[grid]\nname = "Küche"\n', encoding="utf-8")
    assert load_toml(tmp_path / "a.toml") == {"grid": {"name": "Küche"}}


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"a = ", "is not valid TOML"), (b'a = "\xff"', "is not valid TOML"), (None, "does not exist")],
)
def test_a_file_that_is_no_toml_is_refused(tmp_path, content, message):
    path = tmp_path / "a.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=message):
        load_toml(path)


def test_a_folder_is_no_toml_file(tmp_path):
    with pytest.raises(ConfigError, match=r"cannot be read: Is a directory"):
        load_toml(tmp_path)
