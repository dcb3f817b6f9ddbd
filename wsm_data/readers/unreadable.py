"""Files that the system will not give: a loss of this container or frame, never the end of the run."""

import errno
import io
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wsm_data.errors import DataError, Reason
from wsm_data.schema.dataset import ReadLimits

_NOT_THE_FILES_FAULT = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EMFILE, errno.ENFILE, errno.ENOMEM))
"""A full disk, no more open files, no more memory: every other file would fail as well."""

_MAX_FILE_BYTES = ReadLimits().max_file_bytes


@contextmanager
def refusing_unreadable(where: str) -> Iterator[None]:
    """Turn an `OSError` about the file `where` into its refusal.

    Raises:
        DataError: `file.unreadable`.
        OSError: it says nothing about this file, but about the machine.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _NOT_THE_FILES_FAULT:
            raise
        raise DataError(
            Reason.FILE_UNREADABLE,
            f"{where} must be a file or folder that can be read, but {error.strerror or error}; restore what it points "
            "to or its permissions, or fetch it again",
            {"errno": error.errno, "error": error_name(error)},
        ) from error


@contextmanager
def open_file(path: str | Path, where: str) -> Iterator[io.FileIO]:
    """Open a plain file, unbuffered. A pipe or a device is refused without being opened: that could wait for ever.

    Args:
        path: the file.
        where: what to call it in messages.

    Raises:
        DataError: `file.unreadable`, `file.not_regular`.
        OSError: as `refusing_unreadable`.
    """
    with refusing_unreadable(where):
        mode = os.stat(path).st_mode  # noqa: PTH116 - `Path` takes as long as reading a small file
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # opening a folder says what is wrong by itself
            raise DataError(
                Reason.FILE_NOT_REGULAR,
                f"{where} must be a plain file, and is a pipe, a device or a socket, or a link to one; remove it, and "
                "fetch the file again",
                {"mode": stat.filemode(mode)},
            )
        with open(path, "rb", buffering=0, opener=_without_waiting) as file:
            yield file


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)


def read_file(path: str, where: str, max_bytes: int = _MAX_FILE_BYTES) -> bytes:
    """All bytes of a file; for the many small ones of a scene, where building a `Path` takes as long as reading.

    Args:
        path: the file.
        where: what to call it in messages.
        max_bytes: larger ones are refused, unread; the default is that of manifests.

    Raises:
        DataError: `file.unreadable`, `file.not_regular`, `file.too_large`.
        OSError: as `refusing_unreadable`.
    """
    with open_file(path, where) as file:
        size = os.fstat(file.fileno()).st_size
        if size > max_bytes:
            raise too_large(where, size, max_bytes)
        return file.read()


def too_large(where: str, size: int, max_bytes: int) -> DataError:
    """Refusal of a file of more bytes than the manifest allows."""
    return DataError(
        Reason.FILE_TOO_LARGE,
        f"{where} must have at most {max_bytes:,} bytes, and has {size:,}; if it is right, raise the limit in "
        "[limits] of the manifest",
        {"bytes": size, "limit": max_bytes},
    )


def error_name(error: OSError) -> str:
    """Symbol of the system's error, such as ENOENT."""
    return errno.errorcode.get(error.errno or 0, type(error).__name__)
