"""Files that the system will not give: a loss of this container or frame, never the end of the run."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from wsm_data.errors import DataError, Reason

_NOT_THE_FILES_FAULT = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EMFILE, errno.ENFILE, errno.ENOMEM))
"""A full disk, no more open files, no more memory: every other file would fail as well."""


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


def read_file(path: str, where: str) -> bytes:
    """All bytes of a file; for the many small ones of a scene, where building a `Path` takes as long as reading.

    Args:
        path: the file.
        where: what to call it in messages.

    Raises:
        DataError: `file.unreadable`.
        OSError: as `refusing_unreadable`.
    """
    with refusing_unreadable(where), open(path, "rb", buffering=0) as file:  # noqa: PTH123 - see above
        return file.read()


def error_name(error: OSError) -> str:
    """Symbol of the system's error, such as ENOENT."""
    return errno.errorcode.get(error.errno or 0, type(error).__name__)
