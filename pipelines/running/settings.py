"""Settings of stages: from `--set` words, laid over one another, and which of them decide the bytes."""

from collections.abc import Mapping, Sequence
from dataclasses import Field, fields, is_dataclass
from pathlib import Path

from wsm_data.errors import ConfigError
from wsm_data.files.json_values import to_json
from wsm_data.files.typed_toml import INPUT, MAX_SECTIONS, Word


def parse_assignments(assignments: Sequence[str]) -> dict[str, object]:
    """Turn `a.b=c` words into nested mappings of `Word`s.

    Raises:
        ConfigError: a word has no `=`, an empty key, or more sections than any setting.
    """
    result: dict[str, object] = {}
    for assignment in assignments:
        path, equals, text = assignment.partition("=")
        keys = path.strip().split(".")
        if not equals or not all(keys):
            raise ConfigError(f"--set takes key=value or section.key=value, found {assignment!r}")
        if len(keys) > MAX_SECTIONS + 1:
            raise ConfigError(
                f"--set {path[:40]}... has {len(keys) - 1} sections; no setting lies deeper than {MAX_SECTIONS}"
            )
        target = result
        for key in keys[:-1]:
            section = target.setdefault(key, {})
            if not isinstance(section, dict):
                raise ConfigError(f"--set {path}: {key} was given a value before, it cannot also be a section")
            target = section
        target[keys[-1]] = Word(text.strip())
    return result


def merge(base: Mapping[str, object], changes: Mapping[str, object]) -> dict[str, object]:
    """Return `base` with `changes` laid over it, section by section."""
    merged = dict(base)
    for key, value in changes.items():
        old = merged.get(key)
        merged[key] = merge(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return merged


def input_fields(config: object) -> list[str]:
    """Names of the fields of a config, or of its type, that say where an input lies."""
    return [field.name for field in _fields(config) if field.metadata.get("role") == INPUT["role"]]


def settings_of(config: object) -> dict[str, object]:
    """JSON object of the fields that decide the bytes: neither input paths nor speed knobs."""
    return _fields_json(config, skip_roles=True)


def config_json(config: object) -> dict[str, object]:
    """JSON object of every field, paths absolute: a later stage may run from another folder."""
    return _fields_json(config, skip_roles=False)


def _fields(config: object) -> tuple[Field[object], ...]:
    return fields(config)  # type: ignore[arg-type]


def _fields_json(config: object, skip_roles: bool) -> dict[str, object]:
    return {
        field.name: _as_json(getattr(config, field.name), skip_roles)
        for field in _fields(config)
        if not (skip_roles and field.metadata.get("role"))
    }


def _as_json(value: object, skip_roles: bool) -> object:
    if is_dataclass(value):
        return _fields_json(value, skip_roles)
    if isinstance(value, Mapping):
        return {str(key): _as_json(item, skip_roles) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(item, skip_roles) for item in value]
    return str(value.absolute()) if isinstance(value, Path) and not skip_roles else to_json(value)
