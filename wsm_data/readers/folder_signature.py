"""The cheap test for "was anything touched" in a folder: names, sizes and times of its files."""

import os
from collections.abc import Iterator
from pathlib import Path

from wsm_data.files.digest import digest_json
from wsm_data.readers.unreadable import error_name


def folder_signature(folder: Path) -> str:
    """Digest of (relative name, size, mtime in ns) of every file below a folder, hidden ones left out.

    A file or folder that cannot be looked at counts with the system's error.
    """
    return digest_json(sorted(_lines(folder, "")))


def _lines(folder: Path, prefix: str) -> Iterator[list[object]]:
    try:
        entries = [entry for entry in os.scandir(folder) if not entry.name.startswith(".")]
    except OSError as error:
        yield [prefix, error_name(error)]
        return
    for entry in entries:
        name = f"{prefix}{entry.name}"
        if entry.is_dir(follow_symlinks=False):
            yield from _lines(Path(entry.path), f"{name}/")
            continue
        try:
            status = entry.stat()
        except OSError as error:
            yield [name, error_name(error)]
            continue
        yield [name, status.st_size, status.st_mtime_ns]
