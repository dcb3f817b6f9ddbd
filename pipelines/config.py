"""From TOML files and `--set` words to frozen configs: one place for defaults, and no key that is quietly ignored."""

import difflib
import math
import tomllib
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from wsm_data.errors import ConfigError

ConfigT = TypeVar("ConfigT")

INPUT = {"role": "input"}
"""Field metadata: where an input lies. Its content is part of a unit's key, its path is not a setting."""

SPEED = {"role": "speed"}
"""Field metadata: changes how fast the work is done, never the bytes that are written."""


class Word(str):
    """The value of a `--set` word as it was typed: what it means depends on the type of the field it is for."""

    __slots__ = ()


_TYPE_NAMES = {str: "text in quotes", int: "a whole number", float: "a number", bool: "true or false"}


def load_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        ConfigError: the file is absent or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ConfigError(f"configuration file {path} does not exist") from error
    except OSError as error:
        raise ConfigError(f"configuration file {path} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}") from error


def parse_assignments(assignments: Sequence[str]) -> dict[str, Any]:
    """Turn `a.b=c` words into nested mappings of `Word`s.

    Raises:
        ConfigError: a word has no `=` or an empty key.
    """
    result: dict[str, Any] = {}
    for assignment in assignments:
        path, equals, text = assignment.partition("=")
        keys = path.strip().split(".")
        if not equals or not all(keys):
            raise ConfigError(f"--set takes key=value or section.key=value, found {assignment!r}")
        target = result
        for key in keys[:-1]:
            target = target.setdefault(key, {})
            if not isinstance(target, dict):
                raise ConfigError(f"--set {path}: {key} was given a value before, it cannot also be a section")
        target[keys[-1]] = Word(text.strip())
    return result


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return `base` with `changes` laid over it, section by section."""
    merged = dict(base)
    for key, value in changes.items():
        old = merged.get(key)
        merged[key] = merge(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return merged


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
    hints = typing.get_type_hints(config_type)
    known = {field.name: field for field in fields(config_type)}  # type: ignore[arg-type]
    for key in values:
        if key not in known:
            raise ConfigError(_unknown_key(where, key, list(known)))
    arguments = {key: convert(hints[key], value, _dotted(where, key)) for key, value in values.items()}
    for name, field in known.items():
        if name not in arguments and field.default is MISSING and field.default_factory is MISSING:
            raise ConfigError(f"{_dotted(where, name)} must be given: use --set {_dotted(where, name)}=...")
    try:
        return config_type(**arguments)
    except ValueError as error:
        raise ConfigError(f"{where or 'configuration'}: {error}") from error


def settings_of(config: object) -> dict[str, Any]:
    """JSON object of the fields that decide the bytes: neither input paths nor speed knobs."""
    return _as_json(config, skip_roles=True)


def config_json(config: object) -> dict[str, Any]:
    """JSON object of every field, paths absolute: a later stage may run from another folder."""
    return _as_json(config, skip_roles=False)


def differences(old: Mapping[str, Any], new: Mapping[str, Any], where: str = "") -> list[str]:
    """Lines `name: old -> new` for every setting that differs."""
    lines: list[str] = []
    for key in sorted({*old, *new}):
        if key not in old or key not in new:
            lines.append(
                f"{_dotted(where, key)}: " + (f"{old[key]!r} -> absent" if key in old else f"absent -> {new[key]!r}")
            )
        elif isinstance(old[key], Mapping) and isinstance(new[key], Mapping):
            lines += differences(old[key], new[key], _dotted(where, key))
        elif old[key] != new[key]:
            lines.append(f"{_dotted(where, key)}: {old[key]!r} -> {new[key]!r}")
    return lines


def _dotted(where: str, key: str) -> str:
    return f"{where}.{key}" if where else key


def _unknown_key(where: str, key: str, known: list[str]) -> str:
    nearest = difflib.get_close_matches(key, known, n=1)
    hint = f"did you mean {_dotted(where, nearest[0])}?" if nearest else f"known: {', '.join(sorted(known))}"
    return f"unknown setting {_dotted(where, key)}; {hint}"


def convert(hint: Any, value: Any, name: str) -> Any:
    """Convert a TOML value, or a `Word` of `--set`, to a field's type.

    Raises:
        ConfigError: the type does not take the value; `name` says which field that is.
    """
    origin = typing.get_origin(hint)
    if is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise ConfigError(f"{name} is a section, found the value {value!r}")
        return build_config(typing.cast(type, hint), value, name)
    if origin is tuple:
        return _convert_tuple(hint, value, name)
    if origin in (typing.Union, types.UnionType):
        return _convert_union(hint, value, name)
    if isinstance(value, Word):
        value = _meaning(hint, value)
    if hint is Path:
        return Path(_require(value, str, name)).expanduser()
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _convert_enum(hint, value, name)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{name} must be finite, found {value}")
    return _require(value, hint, name)


def _meaning(hint: Any, word: Word) -> Any:
    """What a word means for a field that is neither a section, a tuple nor a union."""
    value = _toml_value(word)
    takes_text = hint in (str, Path) or (isinstance(hint, type) and issubclass(hint, Enum))
    return str(word) if takes_text and not isinstance(value, str) else value


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return str(text)


def _convert_tuple(hint: Any, value: Any, name: str) -> tuple[Any, ...]:
    if isinstance(value, Word) and isinstance(listed := _toml_value(value), list):
        value = listed
    items = value if isinstance(value, (list, tuple)) else [value]
    types_of_items = typing.get_args(hint)
    if len(types_of_items) == 2 and types_of_items[1] is Ellipsis:
        return tuple(convert(types_of_items[0], item, name) for item in items)
    if len(items) != len(types_of_items):
        raise ConfigError(f"{name} takes {len(types_of_items)} values, found {len(items)}")
    return tuple(convert(hint_of_item, item, name) for hint_of_item, item in zip(types_of_items, items, strict=True))


def _convert_union(hint: Any, value: Any, name: str) -> Any:
    choices = [choice for choice in typing.get_args(hint) if choice is not type(None)]
    if value is None or (value == "none" and len(choices) < len(typing.get_args(hint))):
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


def _as_json(value: Any, skip_roles: bool) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: _as_json(getattr(value, field.name), skip_roles)
            for field in fields(value)
            if not (skip_roles and field.metadata.get("role"))
        }
    if isinstance(value, Mapping):
        return {str(key): _as_json(item, skip_roles) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(item, skip_roles) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value if skip_roles else value.absolute())
    return value
