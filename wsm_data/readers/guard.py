"""Whatever the bytes of a container do to a parser is a refusal of this container, not the end of the run.

The list is of what parsers raise about their input: memory that a header asks for, nesting, numbers, text, Arrow. A
`KeyError` or a `TypeError` is not on it: that is a fault of the reader, and keeps its traceback.
"""

import struct
import traceback
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import pyarrow as pa

from wsm_data.errors import DataError, Reason, printable
from wsm_data.readers.source import Container, ContainerScan, SourceReader
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames

_FROM_BYTES = (
    MemoryError,
    RecursionError,
    ArithmeticError,
    ValueError,  # UnicodeError and json's among them
    EOFError,
    struct.error,
    zlib.error,
    pa.ArrowException,
    cv2.error,
)


def guarded(reader: SourceReader) -> SourceReader:
    """The reader, whose `scan` and `iter_frames` refuse a container that its parsers fail on.

    A container whose name has control characters or is not valid text is refused as well: it could neither be stored
    in a table nor be shown.
    """

    def scan(source: Path, container: Container, dataset: DatasetManifest, every: int) -> ContainerScan:
        _require_name(container.id)
        with refusing_unparsable(container.id):
            return reader.scan(source, container, dataset, every)

    def iter_frames(
        source: Path, container: Container, dataset: DatasetManifest, records: Sequence[EpisodeRecord]
    ) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
        with refusing_unparsable(container.id):
            yield from reader.iter_frames(source, container, dataset, records)

    return replace(reader, scan=scan, iter_frames=iter_frames)


@contextmanager
def refusing_unparsable(where: str) -> Iterator[None]:
    """Turn what a parser raises about the bytes of `where` into its refusal.

    Raises:
        DataError: `container.unparsable`; the details say which error, and in which line of which parser.
    """
    try:
        yield
    except _FROM_BYTES as error:
        at = traceback.extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__}: {str(error)[:200]}" if str(error) else type(error).__name__
        raise DataError(
            Reason.CONTAINER_UNPARSABLE,
            f"{where} must hold files that can be parsed within the memory that there is, and one cannot ({what}); "
            "fetch it again, or remove what is not part of the data set",
            {"error": type(error).__name__, "at": f"{Path(at.filename).name}:{at.lineno}"},
        ) from error


def _require_name(name: str) -> None:
    if printable(name) != name or "\n" in name or "\t" in name:
        raise DataError(
            Reason.CONTAINER_UNSTORABLE_NAME,
            f"{name!r} must be a name in UTF-8 without control characters: it can be neither stored nor shown; "
            "rename it",
        )
