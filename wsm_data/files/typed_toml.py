"""From TOML to frozen dataclasses: every value has its field's type, and no key is quietly ignored."""

import difflib
import math
import re
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from wsm_data.errors import ConfigError
from wsm_data.files.locations import require_local

ConfigT = TypeVar("ConfigT")

INPUT = {"role": "input"}
"""Field metadata: where an input lies. Its content is part of a unit's key, its path is not a setting."""

SPEED = {"role": "speed"}
"""Field metadata: changes how fast the work is done, never the bytes that are written."""

SELECTION = {"role": "selection"}
"""Field metadata: allows less than the whole source, without a change to what is written of each unit."""


class Word(str):
    """The value of a `--set` word as it was typed: what it means depends on the type of the field it is for."""

    __slots__ = ()


_EXACT = frozenset((str, int, bool))
_TYPE_NAMES = {str: "text in quotes", int: "a whole number", float: "a number", bool: "true or false"}


MAX_SECTIONS = 16
"""Sections in one key, far more than any setting has. Each is a table within a table, and a line of them would take
minutes and gigabytes to parse."""

_DEEP_KEY = re.compile(rf"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{MAX_SECTIONS + 1}}}""")


def load_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        ConfigError: the file is absent or is not TOML.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if _DEEP_KEY.search(text):
            raise ConfigError(f"{path} has a key of more than {MAX_SECTIONS} sections; no setting lies that deep")
        return tomllib.loads(text)
    except FileNotFoundError as error:
        raise ConfigError(f"configuration file {path} does not exist") from error
    except OSError as error:
        raise ConfigError(f"configuration file {path} cannot be read: {error.strerror}") from error
    except RecursionError as error:
        raise ConfigError(f"{path} nests its values too deeply to be read") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from error


def load_config(config_type: type[ConfigT], path: Path) -> ConfigT:
    """Build a frozen config from a TOML file of its own; every message begins with the file.

    Raises:
        ConfigError: the file is absent or is not TOML, or `build_config` does not take what it says.
    """
    values = load_toml(path)
    try:
        return build_config(config_type, values)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def build_config(config_type: type[ConfigT], values: Mapping[str, Any], where: str = "") -> ConfigT:
    """Build a frozen config from differences to its defaults.

    Args:
        config_type: a keyword-only dataclass; nested dataclasses are sections.
        values: the differences. A `Word` is the text itself for a field of text or a path, unless it is quoted as in
            TOML; for any other field it is read as TOML.
        where: dotted name of the section, for messages.

    Raises:
        ConfigError: an unknown key (with the nearest name), a missing one, or a value the type does not take.
    """
    hints, required = _type_hints(config_type), _required(config_type)  # type: ignore[arg-type]
    arguments = {}
    for key, value in values.items():
        hint = hints.get(key, MISSING)
        if hint is MISSING:
            raise ConfigError(f"unknown key {dotted(where, key)}; {did_you_mean(key, hints, where)}")
        is_plain = hint is Any or (type(value) is hint and hint in _EXACT)  # most of the many that stand beside clips
        arguments[key] = value if is_plain else convert(hint, value, dotted(where, key))
    for name in required:
        if name not in arguments:
            raise ConfigError(f"{dotted(where, name)} has no default: give it as {dotted(where, name)}=...")
    try:
        return config_type(**arguments)
    except ValueError as error:
        raise ConfigError(f"{where}: {error}" if where else str(error)) from error


def convert(hint: Any, value: Any, name: str) -> Any:
    """Convert a TOML value, or a `Word` of `--set`, to a field's type.

    TOML has no null: for a field that may be None, `none` is None. One `Word` is a tuple of one.

    Raises:
        ConfigError: the type does not take the value; `name` says which field that is.
    """
    if hint is Any or (type(value) is hint and hint in _EXACT):
        return value
    origin = _origin(hint)
    if _is_section(hint):
        return build_config(typing.cast(type, hint), _section(value, name), name)
    if origin is Mapping:
        value = _toml_value(value) if isinstance(value, Word) else value
        of_items = _arguments(hint)[1]
        return {key: convert(of_items, item, dotted(name, key)) for key, item in _section(value, name).items()}
    if origin is tuple:
        return _convert_tuple(hint, value, name)
    if origin in (typing.Union, types.UnionType):
        return _convert_union(hint, value, name)
    if isinstance(value, Word):
        value = _meaning(hint, value)
    if hint is Path:
        require_local(name, _require(value, str, name))
        return Path(value).expanduser()
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _convert_enum(hint, value, name)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{name} must be finite, found {value}")
    return _require(value, hint, name)


def did_you_mean(word: str, known: Iterable[str], where: str = "") -> str:
    """The end of a message about an unknown word: the nearest known one, or all of them where none is near."""
    names = list(known)
    nearest = difflib.get_close_matches(word, names, n=1)
    return f"did you mean {dotted(where, nearest[0])}?" if nearest else f"known: {', '.join(names)}"


def dotted(where: str, key: str) -> str:
    """Name of a key in a section, as `--set` takes it."""
    return f"{where}.{key}" if where else key


@cache
def _required(config_type: type) -> tuple[str, ...]:
    """Names of the fields without a default."""
    return tuple(
        field.name for field in fields(config_type) if field.default is MISSING and field.default_factory is MISSING
    )


@cache
def _is_section(hint: Any) -> bool:
    return is_dataclass(hint)


@cache
def _origin(hint: Any) -> Any:
    return typing.get_origin(hint)


@cache
def _arguments(hint: Any) -> tuple[Any, ...]:
    return typing.get_args(hint)


@cache
def _type_hints(config_type: type) -> dict[str, Any]:
    hints = typing.get_type_hints(config_type)
    return {field.name: hints[field.name] for field in fields(config_type)}


def _section(value: Any, name: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} is a section, found the value {value!r}")
    return value


def _meaning(hint: Any, word: Word) -> Any:
    """What a word means for a field that is neither a section, a tuple nor a union."""
    value = _toml_value(word)
    takes_text = hint in (str, Path) or (isinstance(hint, type) and issubclass(hint, Enum))
    return str(word) if takes_text and not isinstance(value, str) else value


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except RecursionError as error:
        raise ConfigError(f"a value nests too deeply to be read: {text[:40]!r}...") from error
    except tomllib.TOMLDecodeError:
        return str(text)


def _convert_tuple(hint: Any, value: Any, name: str) -> tuple[Any, ...]:
    if isinstance(value, Word):
        listed = _toml_value(value)
        value = listed if isinstance(listed, list) else [value]
    if not isinstance(value, (list, tuple)):
        raise ConfigError(f"{name} takes a list in brackets, found {value!r}")
    of_items = _arguments(hint)
    if len(of_items) == 2 and of_items[1] is Ellipsis:
        if of_items[0] is float and all(type(item) is float and math.isfinite(item) for item in value):
            return tuple(value)
        return tuple(convert(of_items[0], item, name) for item in value)
    if len(value) != len(of_items):
        raise ConfigError(f"{name} takes {len(of_items)} values, found {len(value)}")
    return tuple(convert(of_item, item, name) for of_item, item in zip(of_items, value, strict=True))


def _convert_union(hint: Any, value: Any, name: str) -> Any:
    kinds = _arguments(hint)
    choices = [choice for choice in kinds if choice is not type(None)]
    if value is None or (value == "none" and len(choices) < len(kinds)):
        return None
    return convert(choices[0], value, name)


def _convert_enum(hint: type[Enum], value: Any, name: str) -> Enum:
    try:
        return hint(value)
    except ValueError as error:
        choices = ", ".join(str(choice.value) for choice in hint)
        raise ConfigError(f"{name} must be one of {choices}, found {value!r}") from error


def _require(value: Any, hint: Any, name: str) -> Any:
    if not isinstance(value, hint) or (hint is int and isinstance(value, bool)):
        raise ConfigError(f"{name} takes {_TYPE_NAMES.get(hint, hint.__name__)}, found {value!r}")
    return value
