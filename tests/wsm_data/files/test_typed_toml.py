"""From TOML and `--set` words to frozen dataclasses: what is taken, and what is refused by name and value."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import Word, build_config, convert, did_you_mean, load_config, load_toml


class Colour(StrEnum):
    RED = "red"
    DARK_BLUE = "dark_blue"


@dataclass(frozen=True, kw_only=True)
class Grid:
    resolution_m: float = 0.05
    cells: tuple[int, int] = (4, 3)


@dataclass(frozen=True, kw_only=True)
class Config:
    source: Path
    name: str = "a name"
    count: int = 3
    exact: bool = False
    colour: Colour = Colour.RED
    cameras: tuple[str, ...] = ("d435i",)
    limit_m: float | None = None
    grid: Grid = field(default_factory=Grid)
    grids: Mapping[str, Grid] = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.count < 0:
            raise ValueError(f"count must not be negative, found {self.count}")


def built(word):
    """The config of one word as `--set` takes it, with all else by default."""
    key, _, text = word.partition("=")
    values = Word(text)
    for name in reversed(key.split(".")):
        values = {name: values}
    return build_config(Config, {"source": "tree", **values})


@pytest.mark.parametrize(
    ("word", "field_name", "value"),
    [
        ("count=5", "count", 5),
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
        ("grids.fine.resolution_m=0.01", "grids", {"fine": Grid(resolution_m=0.01)}),
        ("counts.mine=5", "counts", {"mine": 5}),
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
    assert convert(int, Word(number), "x") == number


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_read_back_to_the_bit(number):
    assert convert(float, Word(repr(number)), "x").hex() == number.hex()


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("coutn=5", r"unknown key coutn; did you mean count\?"),
        ("grid.resolution=1", r"unknown key grid.resolution; did you mean grid.resolution_m\?"),
        ("qqq=5", "unknown key qqq; known: source, name, count,"),
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
        ("grids.fine.cell=1", r"unknown key grids.fine.cell; did you mean grids.fine.cells\?"),
        ("grids=5", "grids is a section, found the value 5"),
        ("counts.mine=2.5", "counts.mine takes a whole number, found 2.5"),
        ("count=-1", "^count must not be negative, found -1"),
    ],
)
def test_what_a_field_does_not_take_is_refused_by_name_and_value(word, message):
    with pytest.raises(ConfigError, match=message):
        built(word)


def test_a_number_in_a_file_is_not_turned_into_text():
    with pytest.raises(ConfigError, match=r"name takes text in quotes, found 1.1"):
        build_config(Config, {"source": "tree", "name": 1.10})


def test_a_file_gives_a_list_where_a_list_is_due():
    assert build_config(Config, {"source": "tree", "cameras": ["zed"]}).cameras == ("zed",)
    with pytest.raises(ConfigError, match=r"cameras takes a list in brackets, found 'zed'"):
        build_config(Config, {"source": "tree", "cameras": "zed"})


def test_what_has_no_default_must_be_given():
    with pytest.raises(ConfigError, match=r"source has no default: give it as source=\.\.\."):
        build_config(Config, {})
    with pytest.raises(ConfigError, match=r"index.source has no default: give it as index.source=\.\.\."):
        build_config(Config, {}, "index")


def test_what_a_section_refuses_is_said_with_its_name():
    with pytest.raises(ConfigError, match=r"^index: count must not be negative, found -1"):
        build_config(Config, {"source": "tree", "count": -1}, "index")


def test_the_nearest_name_is_proposed_or_all_are_listed():
    assert did_you_mean("indx", ["index", "pack"]) == "did you mean index?"
    assert did_you_mean("radius", ["radius_m"], "robot") == "did you mean robot.radius_m?"
    assert did_you_mean("qqq", ["index", "pack"]) == "known: index, pack"


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


def test_a_config_is_read_from_a_file_of_its_own(tmp_path):
    (tmp_path / "a.toml").write_text('source = "tree"\n[grid]\ncells = [8, 9]\n')
    assert load_config(Config, tmp_path / "a.toml") == Config(source=Path("tree"), grid=Grid(cells=(8, 9)))


def test_what_is_wrong_in_a_file_of_its_own_is_said_with_the_file(tmp_path):
    (tmp_path / "a.toml").write_text('source = "tree"\n[grid]\ncells = [8]\n')
    with pytest.raises(ConfigError, match=rf"^{tmp_path}/a\.toml: grid\.cells takes 2 values, found 1"):
        load_config(Config, tmp_path / "a.toml")


@pytest.mark.parametrize("line", ["a." * 100_000 + "b = 1", "[" + "a . " * 100_000 + "b]", "'a'." * 100_000 + "b = 1"])
def test_keys_deeper_than_any_setting_are_refused_at_once(tmp_path, line):
    path = tmp_path / "deep.toml"
    path.write_text(line)
    with pytest.raises(ConfigError, match="more than 16 sections"):
        load_toml(path)


def test_arrays_nested_without_end_are_refused(tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text("a = " + "[" * 100_000)
    with pytest.raises(ConfigError, match=r"too deeply|not valid TOML"):
        load_toml(path)
