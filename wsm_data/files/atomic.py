"""Files that exist whole or not at all: written under a temporary name, flushed to disk, then renamed."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

TEMPORARY_SUFFIX = ".partial"


@contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open `path` for writing so that readers see the old content, or the whole new one, and nothing between.

    The temporary name is drawn anew each time: two writers of the same path, in whatever thread or on whatever
    machine, do not mix their bytes, and the last to finish wins. When the body raises, the temporary file is removed
    and `path` stays as it was. On return both the bytes and the name are on disk.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}{TEMPORARY_SUFFIX}")
    try:
        with temporary.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        flush_folder(path.parent)
    finally:
        temporary.unlink(missing_ok=True)  # there is none once it has been renamed


def is_full_disk(error: OSError) -> bool:
    """Whether the system refused to write because there is no room, or no more of what this user may take."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT)


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically."""
    with atomic_file(path) as file:
        file.write(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, as UTF-8."""
    write_bytes(path, text.encode())


def remove_temporaries(folder: Path) -> int:
    """Delete what killed writers left below `folder`; returns how many files that were.

    Call it only while nobody writes below `folder`: the files of living writers look the same.
    """
    leftovers = list(folder.rglob(f".*{TEMPORARY_SUFFIX}"))
    for leftover in leftovers:
        leftover.unlink(missing_ok=True)
    return len(leftovers)


def flush_folder(folder: Path) -> None:
    """Bring the folder's list of names to disk: without it a power cut may undo a rename that was reported done."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
