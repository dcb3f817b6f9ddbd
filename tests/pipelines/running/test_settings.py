"""Settings of stages: `--set` words, layers of settings, and what decides the bytes."""

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import pytest

from pipelines.running.settings import config_json, input_fields, merge, parse_assignments, settings_of
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import INPUT, SPEED


class Colour(StrEnum):
    RED = "red"


@dataclass(frozen=True, kw_only=True)
class Grid:
    cells: tuple[int, int] = (4, 3)
    limit_m: float | None = None
    cache: Path = field(default=Path("cache"), metadata=SPEED)


@dataclass(frozen=True, kw_only=True)
class Config:
    source: Path = field(metadata=INPUT)
    colour: Colour = Colour.RED
    grid: Grid = field(default_factory=Grid)


@pytest.mark.parametrize("word", ["count", "=5", ".count=5", "grid.=5", "grid..cells=5", ""])
def test_a_word_without_a_key_or_a_value_is_refused(word):
    with pytest.raises(ConfigError, match=r"--set takes key=value or section.key=value"):
        parse_assignments([word])


def test_a_key_cannot_be_a_value_and_a_section():
    with pytest.raises(ConfigError, match="grid was given a value before, it cannot also be a section"):
        parse_assignments(["grid=5", "grid.cells=[1, 2]"])


def test_words_are_kept_as_they_were_typed_and_later_ones_win():
    assert parse_assignments(["count=1", "grid.cells = [1, 2]", "name=a=b", "count=007"]) == {
        "count": "007",
        "grid": {"cells": "[1, 2]"},
        "name": "a=b",
    }


def test_changes_are_laid_over_section_by_section():
    base = {"grid": {"resolution_m": 0.1, "cells": [1, 2]}, "count": 1}
    assert merge(base, {"grid": {"cells": [3, 4]}, "name": "b"}) == {
        "grid": {"resolution_m": 0.1, "cells": [3, 4]},
        "count": 1,
        "name": "b",
    }
    assert base["grid"] == {"resolution_m": 0.1, "cells": [1, 2]}


def test_settings_hold_neither_inputs_nor_speed_at_any_depth():
    assert settings_of(Config(source=Path("tree"))) == {"colour": "red", "grid": {"cells": [4, 3], "limit_m": None}}


def test_inputs_are_known_by_their_role():
    assert input_fields(Config) == ["source"]


def test_the_whole_config_holds_everything_and_paths_from_the_root(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = config_json(Config(source=Path("tree")))
    assert whole["source"] == str(tmp_path / "tree")
    assert whole["grid"]["cache"] == str(tmp_path / "cache")


def test_a_setting_deeper_than_any_is_refused_at_once():
    with pytest.raises(ConfigError, match="has 100000 sections; no setting lies deeper than 16"):
        parse_assignments(["a." * 100_000 + "b=1"])
