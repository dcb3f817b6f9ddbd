"""A folder that was deleted while it was read or filled, as a sentence."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from pipelines.running.settings import input_fields
from wsm_data.errors import WsmError


@contextmanager
def gone_folder_named(config: object, out: Path) -> Iterator[Callable[[], None]]:
    """Turn a file that is not found into an error for a person, where the folder it lay in is gone.

    Args:
        config: settings of a stage; its inputs that are paths are looked at.
        out: the folder that is filled.

    Yields:
        A function that raises this error for the folder that is filled: whoever writes makes one anew that was deleted,
        without what was in it.

    Raises:
        WsmError: a folder is gone, or another one stands in its place.
    """
    inputs = [getattr(config, name) for name in input_fields(config)]
    began = {folder: _identity(folder) for folder in (*inputs, out) if isinstance(folder, Path)}
    try:
        yield lambda: _require_same({out: began[out]})
    except (FileNotFoundError, NotADirectoryError) as error:
        _require_same(began, error)
        raise


def _require_same(began: Mapping[Path, tuple[int, int] | None], error: OSError | None = None) -> None:
    for folder, before in began.items():
        if before is not None and _identity(folder) != before:
            said = f" ({error})" if error else ""
            raise WsmError(
                f"{folder} is gone, or another one is in its place, and was there when the command began{said}; bring "
                "it back and run the same command again: what is done is kept where it still is"
            ) from error


def _identity(path: Path) -> tuple[int, int] | None:
    """What tells a file or folder from another one under its name; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
