"""The conventions of a source, from its TOML file: a wrong word is an error, never a default."""

import difflib
import tomllib
import types
import typing
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from wsm_data.errors import ConfigError
from wsm_data.schema.dataset import DatasetManifest

MANIFEST_FOLDER = Path(__file__).resolve().parents[2] / "manifests" / "datasets"
"""Where the shipped manifests lie: beside the packages, in a checkout as in an installed wheel."""


def load_dataset(name_or_path: str | Path) -> DatasetManifest:
    """Read the manifest of a data set.

    Args:
        name_or_path: the name of a shipped manifest, such as `interndata_n1`, or the path of a TOML file: a `Path`, or
            text with a `/` or the ending `.toml`.

    Raises:
        ConfigError: no such manifest, not TOML, or a key, type or value that does not belong there.
    """
    path = _manifest_path(name_or_path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"the data set manifest {path} cannot be read: {error.strerror}") from error
    except ValueError as error:  # TOML syntax, or bytes that are not UTF-8
        raise ConfigError(f"the data set manifest {path} is not valid TOML: {error}") from error
    manifest: DatasetManifest = _build(DatasetManifest, content, path, ())
    return manifest


def _manifest_path(name_or_path: str | Path) -> Path:
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or text.endswith(".toml"):
        return Path(text)
    known = sorted(path.stem for path in MANIFEST_FOLDER.glob("*.toml"))
    if text not in known:
        raise ConfigError(f"there is no data set {text!r}{_nearest(text, known)}; known are {', '.join(known)}")
    return MANIFEST_FOLDER / f"{text}.toml"


def _nearest(word: str, known: list[str]) -> str:
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.0)
    return f" (nearest: {close[0]!r})" if close else ""


def _build(cls: type, content: Mapping[str, object], path: Path, keys: tuple[str, ...]) -> Any:
    """Make the dataclass `cls` of a TOML table; `keys` say where in the file it stands."""
    where = f"{path}: [{'.'.join(keys)}]" if keys else str(path)
    hints = typing.get_type_hints(cls)
    for key in content:
        if key not in hints:
            raise ConfigError(f"{where} has an unknown key {key!r}{_nearest(key, sorted(hints))}")
    try:
        return cls(**{key: _convert(hints[key], value, path, (*keys, key)) for key, value in content.items()})
    except TypeError as error:  # a field without default is absent
        required = [field.name for field in fields(cls) if field.name not in content]
        raise ConfigError(f"{where} lacks a required key; absent are {', '.join(required)}") from error
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from error


def _convert(hint: Any, value: object, path: Path, keys: tuple[str, ...]) -> Any:
    """Check one TOML value against a field's type; whole numbers are welcome where a float is asked for."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if is_dataclass(hint) and isinstance(hint, type) and isinstance(value, dict):
        return _build(hint, value, path, keys)
    if origin in (typing.Union, types.UnionType):
        return _convert(next(option for option in arguments if option is not type(None)), value, path, keys)
    if origin is tuple and isinstance(value, list) and (arguments[-1] is ... or len(value) == len(arguments)):
        return tuple(_convert(arguments[0], item, path, keys) for item in value)
    if origin is Mapping.__class__ or origin is Mapping or (isinstance(origin, type) and issubclass(origin, Mapping)):
        if isinstance(value, dict):
            return {name: _convert(arguments[1], item, path, (*keys, name)) for name, item in value.items()}
    elif hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    elif hint in (int, str) and type(value) is hint:
        return value
    raise ConfigError(f"{path}: {'.'.join(keys)} must be {hint}, found {value!r}")
