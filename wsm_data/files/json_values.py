"""Frozen dataclasses as JSON objects, and back by the types of their fields, exactly; whole files of them too."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.differences import differences
from wsm_data.files.jsonlines import read_lines
from wsm_data.files.typed_toml import build_config

ValueT = TypeVar("ValueT")

_PLAIN = frozenset((str, int, float, bool, type(None)))


def to_json(value: Any) -> Any:
    """The JSON value of a value: dataclasses and mappings as objects, sequences as lists, enums and paths as text.

    Numbers survive JSON to the bit. What is none of these is left as it is.
    """
    if type(value) in _PLAIN:
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_json(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_json(item) for item in value]
    if isinstance(value, Enum):
        return value.value
    return str(value) if isinstance(value, Path) else value


def from_json(kind: type[ValueT], record: Mapping[str, Any], *, complete: bool = True) -> ValueT:
    """Inverse of `to_json`: every field must be there, at any depth, none may be unknown, and each have its type.

    Args:
        kind: the dataclass.
        record: what its JSON object is read as.
        complete: whether fields that have a default must be there too; an earlier version may not have had them.

    Raises:
        ValueError: the object is none of this kind; says which field is why.
    """
    if not isinstance(record, Mapping):
        raise ValueError(f"it must be an object of {kind.__name__}, found {record!r}")
    try:
        value = build_config(kind, record)
    except ConfigError as error:
        raise ValueError(str(error)) from error
    again = to_json(value) if complete else record
    if record != again and (changed := differences(record, again)):
        raise ValueError(f"it must have exactly the fields of {kind.__name__}, differing: {'; '.join(changed)}")
    return value


def load_json(kind: type[ValueT], path: Path, must_hold: str, remedy: str) -> ValueT:
    """The dataclass whose JSON object a file holds; fields that have a default may be missing.

    Args:
        kind: the dataclass.
        path: the file.
        must_hold: what it must hold, for the message.
        remedy: what to do about a file that does not.

    Raises:
        IntegrityError: the file is missing, or does not hold such an object.
    """
    try:
        return from_json(kind, json.loads(path.read_bytes()), complete=False)
    except (OSError, ValueError) as error:
        raise IntegrityError(f"{path} must hold {must_hold}, but: {error}; {remedy}") from error


def load_json_lines(kind: type[ValueT], path: Path, must_hold: str, remedy: str) -> Iterator[ValueT]:
    """The dataclasses whose JSON objects the lines of a file hold; fields that have a default may be missing.

    Args:
        kind: the dataclass.
        path: the file; one that does not exist has no lines.
        must_hold: what each line must hold, for the message.
        remedy: what to do about a line that does not.

    Raises:
        IntegrityError: a line does not hold such an object.
    """
    for number, record in enumerate(read_lines(path), start=1):
        try:
            yield from_json(kind, record, complete=False)
        except ValueError as error:
            raise IntegrityError(f"{path}:{number} must hold {must_hold}, but: {error}; {remedy}") from error
