"""What a page asks of the table of clips, from the words of its address."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from wsm_data.errors import ConfigError

MAX_LIMIT = 500
_AT_ONCE = 60


@dataclass(frozen=True, kw_only=True)
class ClipQuery:
    """Which clips are wanted, and in which order.

    Attributes:
        text: part of the key, in capitals or not; empty for all.
        words: by text column, the value that it must have.
        least: by number column, the smallest value; a clip without a value is left out.
        most: by number column, the largest value, likewise.
        selection: name of a selection; empty for all clips.
        sort: column by which clips are sorted; clips without a value come last.
        descending: largest first.
        offset: how many clips are left out before the first.
        limit: how many are listed.
    """

    text: str = ""
    words: Mapping[str, str] = field(default_factory=dict)
    least: Mapping[str, float] = field(default_factory=dict)
    most: Mapping[str, float] = field(default_factory=dict)
    selection: str = ""
    sort: str = "key"
    descending: bool = False
    offset: int = 0
    limit: int = _AT_ONCE


def parse_query(words: Mapping[str, str]) -> ClipQuery:
    """Read `text`, `is.COLUMN`, `min.COLUMN`, `max.COLUMN`, `selection`, `sort`, `descending`, `offset`, `limit`.

    Other words are those of the page itself and are left alone; so is whatever has no value.

    Raises:
        ConfigError: a number is none.
    """
    given = {name: value for name, value in words.items() if value != ""}
    limit = whole_number(given, "limit", _AT_ONCE)
    return ClipQuery(
        text=given.get("text", ""),
        words=_of_columns(given, "is."),
        least={name: _number(value, f"min.{name}") for name, value in _of_columns(given, "min.").items()},
        most={name: _number(value, f"max.{name}") for name, value in _of_columns(given, "max.").items()},
        selection=given.get("selection", ""),
        sort=given.get("sort", "key"),
        descending=given.get("descending", "") == "1",
        offset=whole_number(given, "offset", 0),
        limit=min(limit, MAX_LIMIT),
    )


def whole_number(words: Mapping[str, str], name: str, default: int) -> int:
    """A number of 0 or more among the words of an address.

    Raises:
        ConfigError: it is none.
    """
    value = words.get(name, "") or str(default)
    if not (value.isascii() and value.isdigit() and len(value) < 10):
        raise ConfigError(f"{name} must be a whole number of 0 or more, found {value!r}")
    return int(value)


def _of_columns(words: Mapping[str, str], prefix: str) -> dict[str, str]:
    return {name.removeprefix(prefix): value for name, value in words.items() if name.startswith(prefix)}


def _number(value: str, name: str) -> float:
    try:
        number = float(value)
    except ValueError as error:
        raise ConfigError(f"{name} must be a number, found {value!r}") from error
    if math.isnan(number):
        raise ConfigError(f"{name} must be a number, found {value!r}")
    return number
