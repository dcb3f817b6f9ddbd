"""Images and their times: a text file of lines, or numbers in the names of files."""

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.readers.unreadable import read_file
from wsm_data.schema.arrays import Float64Array

_NUMBER = re.compile(r"\d+")


@dataclass(frozen=True, kw_only=True)
class StampedFiles:
    """Files in the order of their times.

    Attributes:
        stamps_s: rising, s, or the number of the file; float64 [N].
        names: relative to the folder of the sequence, with `/`.
    """

    stamps_s: Float64Array
    names: tuple[str, ...]


def read_listing(folder: Path, name: str, where: str) -> StampedFiles:
    """The files that `name` lists, or that fit it where it is a pattern with a `*`.

    Args:
        folder: of the sequence.
        name: as `SequenceFiles.rgb`.
        where: what to call the sequence in messages.

    Raises:
        DataError: `sequence.unreadable`: there is no such list, it has a line that is no stamp and file, or a time
            that is there twice.
    """
    rows = numbered_files(folder, name, where) if "*" in name else _listed(folder, name, where)
    if not rows:
        raise unreadable(where, f"{name} must name an image, and names none")
    rows.sort()
    stamps_s = np.array([stamp for stamp, _ in rows])
    twice = np.flatnonzero(np.diff(stamps_s) == 0)
    if len(twice):
        raise unreadable(where, f"{name} has the time {stamps_s[twice[0]]} twice")
    return StampedFiles(stamps_s=stamps_s, names=tuple(file for _, file in rows))


def data_lines(folder: Path, name: str, where: str) -> list[tuple[int, list[str]]]:
    """Numbers and words of the lines of a text file that are neither empty nor a comment (`#`).

    Raises:
        DataError: `sequence.unreadable`, or `file.unreadable`.
    """
    try:
        text = read_file(str(folder / name), f"{where}:{name}").decode()
    except UnicodeDecodeError as error:
        raise unreadable(where, f"{name} must be text, and is not ({error.reason})") from error
    lines = [(number, line.split()) for number, line in enumerate(text.splitlines(), 1)]
    return [(number, words) for number, words in lines if words and not words[0].startswith("#")]


def numbered_files(folder: Path, pattern: str, where: str) -> list[tuple[float, str]]:
    """The last number in the name, and the name, of every file that fits a pattern.

    Raises:
        DataError: `sequence.unreadable`: a name without a number.
    """
    rows = []
    for path in folder.glob(pattern):
        numbers = _NUMBER.findall(path.stem)
        if not numbers:
            raise unreadable(where, f"files of {pattern} must be numbered, and {path.name} has no number")
        rows.append((float(numbers[-1]), path.relative_to(folder).as_posix()))
    return rows


def unreadable(where: str, why: str) -> DataError:
    """A refusal of a sequence whose lists, poses or camera are not in their format."""
    return DataError(
        Reason.SEQUENCE_UNREADABLE, f"{where}: {why}; repair the sequence, or the manifest's section [files]"
    )


def _listed(folder: Path, name: str, where: str) -> list[tuple[float, str]]:
    rows = []
    for number, words in data_lines(folder, name, where):
        try:
            stamp, file = words
            stamp_s = float(stamp)
        except ValueError as error:
            raise unreadable(where, f"line {number} of {name} must be `stamp file`, found {words}") from error
        if not np.isfinite(stamp_s) or PurePosixPath(file).is_absolute() or ".." in PurePosixPath(file).parts:
            raise unreadable(where, f"line {number} of {name} must be a time and a file of the sequence, found {words}")
        rows.append((stamp_s, PurePosixPath(file).as_posix()))
    return rows
