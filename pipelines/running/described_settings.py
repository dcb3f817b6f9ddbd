"""Every setting of a config by name, type, default and meaning, as the dataclasses and their docstrings say them."""

import inspect
import json
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from pipelines.running.command_text import toml_text
from wsm_data.files.typed_toml import dotted

REQUIRED = "required"
SECTION = "section"

_ENTRY = re.compile(r" {4}(\w+(?:, \w+)*): (.*)")
_TYPE_NAMES = {str: "text", int: "whole number", float: "number", bool: "true or false", Path: "path"}


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting, or the section that settings lie in.

    Attributes:
        name: dotted, as `--set` takes it; `[]` stands behind a list of sections, `NAME` for a key of one's own.
        type: what it takes, in words; `section` where settings lie below it.
        default: as TOML, or `none`; `required` where there is none; empty for a section.
        meaning: what the docstring of its config says of it.
    """

    name: str
    type: str
    default: str
    meaning: str


def describe_settings(config_type: type, defaults: object = None, where: str = "") -> Iterator[Setting]:
    """Every setting of a config in the order of its fields, those of a section behind it.

    Args:
        config_type: a dataclass; nested dataclasses are sections.
        defaults: the config by which a section is filled where its own defaults do not hold.
        where: dotted name of the section.
    """
    hints, meanings = typing.get_type_hints(config_type), attribute_meanings(config_type)
    for field in fields(config_type):
        hint, name = hints[field.name], dotted(where, field.name)
        value = _default(field) if defaults is None else getattr(defaults, field.name)
        section, below, filled = _section(hint, name, value)
        shown = "" if is_dataclass(hint) else REQUIRED if value is MISSING else toml_text(value)
        yield Setting(name=name, type=_type_text(hint), default=shown, meaning=meanings.get(field.name, ""))
        if section is not None:
            yield from describe_settings(section, filled, below)


def attribute_meanings(config_type: type) -> dict[str, str]:
    """What the `Attributes:` section of a class, and of those it inherits from, says of each attribute."""
    meanings: dict[str, str] = {}
    for one in reversed(config_type.__mro__):
        text = inspect.cleandoc(one.__doc__ or "").partition("\nAttributes:\n")[2]
        names: list[str] = []
        for line in text.splitlines():
            entry = _ENTRY.fullmatch(line)
            if line and not line.startswith(" "):
                break  # the next section of the docstring
            if entry:
                names = entry[1].split(", ")
                meanings |= dict.fromkeys(names, entry[2])
            elif line:
                meanings |= {name: f"{meanings[name]} {line.strip()}" for name in names}
    return meanings


def _default(field: Field[Any]) -> object:
    return field.default if field.default_factory is MISSING else field.default_factory()


def _section(hint: Any, name: str, value: object) -> tuple[type | None, str, object]:
    """The dataclass whose settings lie below a field, the name they have there, and what fills them by default."""
    if is_dataclass(hint):
        return typing.cast(type, hint), name, None if value is MISSING else value
    inner = [one for one in typing.get_args(hint) if is_dataclass(one)]
    below = f"{name}.NAME" if typing.get_origin(hint) is Mapping else f"{name}[]"
    return (typing.cast(type, inner[0]) if inner else None), below, None


def _type_text(hint: Any) -> str:
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if is_dataclass(hint):
        return SECTION
    if origin is Mapping:
        return f"{_type_text(inner[1])} by name"
    if origin is tuple:
        of_items = _type_text(inner[0])
        return f"list: {of_items} each" if inner[-1] is Ellipsis else f"list of {len(inner)}: {of_items} each"
    if origin in (typing.Union, types.UnionType):
        return ", or ".join("none" if one is type(None) else _type_text(one) for one in inner)
    if issubclass(hint, Enum):
        return " or ".join(json.dumps(one.value) for one in hint)
    return _TYPE_NAMES[hint]
