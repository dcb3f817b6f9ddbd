"""A command as it would be typed: every setting that is not the default, in one spelling."""

import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum

from wsm_data.files.typed_toml import dotted


def command_text(words: str, config: object, default: object) -> str:
    """The command that has the settings of `config`; inputs and speed are left out.

    Two ways to say the same, on the command line or in a file and in any order, have one text.

    Args:
        words: the command and its arguments, such as `wsm select RELEASE`.
        config: what was set.
        default: a config of the same type with default settings.
    """
    return " ".join([words, *(f"--set {shlex.quote(word)}" for word in _assignments(config, default))])


def toml_text(value: object) -> str:
    """A value as `--set` takes it; what is None is left out of a table, where it stands for the default."""
    if is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, Mapping):
        items = [f"{json.dumps(key)} = {toml_text(item)}" for key, item in sorted(value.items()) if item is not None]
        return "{" + ", ".join(items) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_text(item) for item in value) + "]"
    if isinstance(value, Enum):
        return json.dumps(value.value)
    return "none" if value is None else json.dumps(value)


def _assignments(config: object, default: object, where: str = "") -> Iterator[str]:
    for field in fields(config):  # type: ignore[arg-type]
        value, old = getattr(config, field.name), getattr(default, field.name)
        name = dotted(where, field.name)
        if field.metadata.get("role") or value == old:
            continue
        if is_dataclass(value):
            yield from _assignments(value, old, name)
        else:
            yield f"{name}={toml_text(value)}"
