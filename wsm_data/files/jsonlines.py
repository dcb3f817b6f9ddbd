"""JSON in one canonical spelling, and files of one JSON object a line."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import write_bytes

_CANONICAL = json.JSONEncoder(sort_keys=True, separators=(",", ":"), allow_nan=False)


def canonical_json(value: object) -> str:
    """Return the one spelling of a JSON value: sorted keys, no spaces, floats in their shortest exact form, ASCII.

    Equal JSON values have equal spellings; 1 and 1.0 are different JSON values. Being ASCII, it can hold the name of
    a file that is not valid UTF-8, which Python represents by lone surrogates.

    Raises:
        ValueError: a number is NaN or infinite, which JSON does not have.
        TypeError: something is not a JSON value, such as a numpy scalar.
    """
    return _CANONICAL.encode(value)


@contextmanager
def line_appender(path: Path) -> Iterator[Callable[[Mapping[str, object]], None]]:
    """Open a file for more records; yields the function that appends one, which then survives the process's death."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("ab") as file:
        try:

            def append(record: Mapping[str, object]) -> None:
                file.write(canonical_json(record).encode() + b"\n")
                file.flush()

            yield append
        finally:
            os.fsync(file.fileno())


def write_lines(path: Path, records: Iterable[Mapping[str, object]]) -> None:
    """Write all records atomically, replacing what was there."""
    write_bytes(path, b"".join(canonical_json(record).encode() + b"\n" for record in records))


def read_lines(path: Path) -> Iterator[dict[str, object]]:
    """Yield the records of a file; a file that does not exist has none.

    A last line without its newline is what a killed writer leaves: it is passed over.

    Raises:
        IntegrityError: a complete line is not a JSON object.
    """
    if not path.exists():
        return
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            if line.endswith(b"\n"):
                yield parse_line(path, number, line)


def parse_line(path: Path, number: int, line: bytes) -> dict[str, object]:
    """The record of a line; path and number are for messages.

    Raises:
        IntegrityError: the line is not a JSON object.
    """
    try:
        record = json.loads(line)
    except ValueError as error:
        raise IntegrityError(f"{path}:{number} is not JSON ({error}); restore the file or delete the line") from error
    if not isinstance(record, dict):
        raise IntegrityError(f"{path}:{number} must hold one JSON object, found {type(record).__name__}")
    return record
