"""JSON in one canonical spelling, and files of one JSON object a line."""

import json
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import write_bytes

_SYNC_EVERY_S = 0.2


def canonical_json(value: object) -> str:
    """Return the one spelling of a JSON value: sorted keys, no spaces, floats in their shortest exact form, ASCII.

    Equal JSON values have equal spellings; 1 and 1.0 are different JSON values. Being ASCII, it can hold the name of
    a file that is not valid UTF-8, which Python represents by lone surrogates.

    Raises:
        ValueError: a number is NaN or infinite, which JSON does not have.
        TypeError: something is not a JSON value, such as a numpy scalar.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


@contextmanager
def line_appender(path: Path) -> Iterator[Callable[[Mapping[str, object]], dict[str, object]]]:
    """Open a file for more records; yields the function that appends one and returns it as `read_lines` will.

    A record is with the operating system when that function returns: it survives the death of this process. What
    survives a power cut is everything up to 0.2 s before, and all once the file is closed. A flush to disk after every
    line would cost 0.4 to 1.1 ms a line on a fast disk, four to ten times all else that the runner does for a unit.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("ab") as file:
        synced_s = time.monotonic()

        def append(record: Mapping[str, object]) -> dict[str, object]:
            nonlocal synced_s
            line = canonical_json(record).encode() + b"\n"
            file.write(line)
            file.flush()
            if time.monotonic() - synced_s >= _SYNC_EVERY_S:
                os.fsync(file.fileno())
                synced_s = time.monotonic()
            return dict(json.loads(line))

        try:
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
                yield _parse(path, number, line)


def drop_torn_line(path: Path) -> None:
    """Cut the unfinished last line that a killed writer left, so that the next append starts a line of its own.

    Call it once before the first append to a file that an earlier process may have written.
    """
    if not path.exists():
        return
    data = path.read_bytes()
    if data and not data.endswith(b"\n"):
        write_bytes(path, data[: data.rfind(b"\n") + 1])


def _parse(path: Path, number: int, line: bytes) -> dict[str, object]:
    try:
        record = json.loads(line)
    except ValueError as error:
        raise IntegrityError(f"{path}:{number} is not JSON ({error}); restore the file or delete the line") from error
    if not isinstance(record, dict):
        raise IntegrityError(f"{path}:{number} must hold one JSON object, found {type(record).__name__}")
    return record
