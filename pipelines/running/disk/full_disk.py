"""A full disk as a sentence, wherever a folder is filled."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wsm_data.errors import WsmError
from wsm_data.files.atomic import is_full_disk


@contextmanager
def full_disk_named(folder: Path) -> Iterator[None]:
    """Turn a write that found no room, wherever it was, into an error for a person."""
    try:
        yield
    except OSError as error:
        if not is_full_disk(error):
            raise
        raise WsmError(
            f"the disk of {folder} is full ({error}); free space and run the same command again: what is done is kept"
        ) from error
