"""Settings of stages: from `--set` words, laid over one another, and which of them decide the bytes."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import INPUT, Word, dotted


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


def input_fields(config_type: Any) -> list[str]:
    """Names of the fields of a config that say where an input lies."""
    return [field.name for field in fields(config_type) if field.metadata.get("role") == INPUT["role"]]


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
                f"{dotted(where, key)}: " + (f"{old[key]!r} -> absent" if key in old else f"absent -> {new[key]!r}")
            )
        elif isinstance(old[key], Mapping) and isinstance(new[key], Mapping):
            lines += differences(old[key], new[key], dotted(where, key))
        elif old[key] != new[key]:
            lines.append(f"{dotted(where, key)}: {old[key]!r} -> {new[key]!r}")
    return lines


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
