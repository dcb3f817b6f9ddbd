"""Which process of this machine writes a stage's folder, found without taking the lock."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

from pipelines.running.folder import LOCK_FILE

_LOCKS = Path("/proc/locks")
_FIELDS = 8
"""Of a line `1: FLOCK ADVISORY WRITE <pid> <major>:<minor>:<inode> 0 EOF`; one that waits has `->` after the number."""

Locks: TypeAlias = Mapping[tuple[int, int, int], int]
"""Process that holds a lock, by major and minor number of the device and inode of the file."""


def held_locks(table: Path = _LOCKS) -> Locks | None:
    """Locks on files that processes of this machine hold now; None where the system has no such table."""
    if not table.exists():
        return None
    rows = [line.split() for line in table.read_text().splitlines()]
    return {_file(row[5]): int(row[4]) for row in rows if len(row) == _FIELDS and row[1] == "FLOCK"}


def lock_holder(folder: Path, locks: Locks) -> int | None:
    """Id of the process that holds a stage's folder; None where none of this machine does."""
    path = folder / LOCK_FILE
    if not path.exists():
        return None
    found = path.stat()
    return locks.get((os.major(found.st_dev), os.minor(found.st_dev), found.st_ino))


def _file(text: str) -> tuple[int, int, int]:
    major, minor, inode = text.split(":")
    return int(major, 16), int(minor, 16), int(inode)
