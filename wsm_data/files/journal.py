"""A journal: records that are appended by several writers without a lock, and survive a kill.

Each writer creates a file of its own, `NAME.jsonl`, `NAME.000001.jsonl` and so on, and nobody opens it for writing
again: that is as safe on a network file system as on a disk. Files are read in the order of their numbers and records
in the order of their lines, so all readers see one order, and no clock is compared. Who begins later has the higher
number; of two who write at the same time, the records of one come after all of the other.

A line is a JSON object whose last member, `xxh3`, is the xxh3_64 of the object without it. What has no line break at
the end of a file was cut by a kill, or is the zeros that a power cut leaves: it is passed over. Every other line must
have its checksum. A file whose first line has none is one of plain lines, as they were written before checksums.
"""

import errno
import io
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import flush_folder, write_bytes
from wsm_data.files.digest import xxh3_64
from wsm_data.files.jsonlines import canonical_json, parse_line

_FILE_NAME = re.compile(r"([^.]+)(?:\.([0-9]{6,}))?\.jsonl")
_MARK = b'"xxh3":'
_SEAL_BYTES = len(b',"xxh3":"0123456789abcdef"}\n')


class JournalWriter:
    """Appends records to a file of its own, which is created with the first of them.

    A record is with the operating system when `append` returns: it survives the death of the process. A power cut
    costs what was not brought to disk yet.

    Args:
        folder: where the files of the journal lie.
        name: name of the journal, without dots.
        sync_every_s: what is appended is brought to disk after this time at most, while there are appends; None leaves
            that to the system until `close`. A flush with each record would cost 0.4 to 1.1 ms on a fast disk.
    """

    def __init__(self, folder: Path, name: str, sync_every_s: float | None = None):
        self._folder, self._name, self._sync_every_s = folder, name, sync_every_s
        self._file: io.FileIO | None = None
        self._synced_s = 0.0
        self._torn = False

    def append(self, record: Mapping[str, object]) -> None:
        """Append a record of at least one member.

        Raises:
            OSError: it could not be written; no record can follow it then.
        """
        if self._file is None:
            self._file, self._synced_s = _create(self._folder, self._name), time.monotonic()
        if self._torn:
            raise OSError(errno.EIO, "a record was cut short before: none can follow it", self._file.name)
        line = _sealed(record)
        self._torn = True
        if self._file.write(line) != len(line):
            raise OSError(errno.ENOSPC, "a record was cut short; is the disk full?", self._file.name)
        self._torn = False
        if self._sync_every_s is not None and time.monotonic() - self._synced_s >= self._sync_every_s:
            self.sync()

    def sync(self) -> None:
        """Bring what was appended to disk."""
        if self._file is not None:
            os.fsync(self._file.fileno())
            self._synced_s = time.monotonic()

    def close(self, last: Mapping[str, object] | None = None) -> None:
        """Bring the file to disk and close it, after a last record where no record was cut short before."""
        file = self._file
        if file is None:
            return
        with file:
            if last is not None and not self._torn:
                self.append(last)
            os.fsync(file.fileno())
        self._file = None

    def __enter__(self) -> "JournalWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def file_name(name: str, number: int) -> str:
    """Name of the file that is number `number` of a journal's."""
    return f"{name}.{number:06d}.jsonl" if number else f"{name}.jsonl"


def journal_files(folder: Path) -> dict[tuple[str, int], Path]:
    """The files of all journals in a folder by (name, number), in that order; none where there is no folder."""
    paths = folder.iterdir() if folder.is_dir() else ()
    named = [(match, path) for path in paths if (match := _FILE_NAME.fullmatch(path.name))]
    return dict(sorted(((match[1], int(match[2] or 0)), path) for match, path in named))


def read_records(path: Path) -> Iterator[dict[str, Any]]:
    """The records of one file.

    Raises:
        IntegrityError: a whole line does not have the checksum that was written with it, or is no JSON object.
    """
    plain = None
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            if not line.endswith(b"\n"):
                return
            plain = _MARK not in line if plain is None else plain
            yield parse_line(path, number, _plain(path, number, line) if plain else _unsealed(path, number, line))


def read_journal(folder: Path, name: str) -> Iterator[dict[str, Any]]:
    """The records of all writers of a journal.

    Raises:
        IntegrityError: as `read_records`.
    """
    for path in _files_of(folder, name).values():
        yield from read_records(path)


def torn_bytes(path: Path) -> int:
    """Bytes behind the last line break: of a record that was not written to its end."""
    data = path.read_bytes()
    return len(data) - data.rfind(b"\n") - 1


def rewrite_journal(folder: Path, name: str, records: Iterable[Mapping[str, object]]) -> None:
    """Put the records into the first file, atomically, and delete the others. Call it only while nobody else writes.

    Killed in between, it leaves the latest of the others, in their order: what they say last is still the last word.
    """
    write_bytes(folder / file_name(name, 0), b"".join(_sealed(record) for record in records))
    for number, path in _files_of(folder, name).items():
        if number:
            path.unlink()


def _files_of(folder: Path, name: str) -> dict[int, Path]:
    return {number: path for (owner, number), path in journal_files(folder).items() if owner == name}


def _create(folder: Path, name: str) -> io.FileIO:
    """A new file, numbered after those that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    number = max(_files_of(folder, name), default=-1) + 1
    while True:
        try:
            file = (folder / file_name(name, number)).open("xb", buffering=0)
        except FileExistsError:  # another writer was faster
            number += 1
        else:
            flush_folder(folder)
            return file


def _sealed(record: Mapping[str, object]) -> bytes:
    body = canonical_json(record).encode()
    return body[:-1] + b',"xxh3":"' + xxh3_64(body).encode() + b'"}\n'


def _plain(path: Path, number: int, line: bytes) -> bytes:
    if _MARK in line:
        raise IntegrityError(f"{path}:1 must have a checksum as line {number} has, found other bytes; restore the file")
    return line


def _unsealed(path: Path, number: int, line: bytes) -> bytes:
    body = line[:-_SEAL_BYTES] + b"}"
    if line[-_SEAL_BYTES:] != b',"xxh3":"' + xxh3_64(body).encode() + b'"}\n':
        raise IntegrityError(
            f"{path}:{number} must have the checksum that was written with it, found other bytes; restore the file"
        )
    return body
