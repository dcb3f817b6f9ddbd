"""The decompressed bytes of a gzip file in one reused buffer: nothing is allocated or copied for each member."""

import gzip
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from zlib_ng import zlib_ng

from wsm_data.errors import DataError, Reason

_BUFFER_BYTES = 1 << 19
_GZIP_MAGIC = b"\x1f\x8b"
_POINTER = b"version https://git-lfs"


class GzipStream:
    """Sequential access to the content of a gzip file, several gzip members in a row included."""

    def __init__(self, file: BinaryIO, where: str):
        # The reader behind `gzip_ng.open`, taken directly: `GzipNGFile.readinto` reads into new bytes and copies them.
        self._reader = zlib_ng._GzipReader(file, _BUFFER_BYTES)
        self._where = where
        self._buffer = memoryview(bytearray(_BUFFER_BYTES))
        self._start = self._end = 0
        self.position = 0

    def take(self, size: int) -> memoryview:
        """The next `size` bytes, valid until the next call.

        Raises:
            DataError: `archive.truncated` or `archive.corrupt`.
        """
        while self._end - self._start < size:
            self._fill(size)
        view = self._buffer[self._start : self._start + size]
        self._start += size
        self.position += size
        return view

    def skip(self, size: int) -> None:
        """Pass over `size` bytes without holding them.

        Raises:
            DataError: as `take`.
        """
        while size > 0:
            size -= len(self.take(min(size, _BUFFER_BYTES)))

    def rest(self) -> Iterator[memoryview]:
        """What remains, in pieces; reading it to the end verifies the gzip checksum.

        Raises:
            DataError: as `take`.
        """
        yield self._buffer[self._start : self._end]
        while count := self._read_into(self._buffer):
            yield self._buffer[:count]

    def _fill(self, size: int) -> None:
        """Read on. The buffer doubles only as data really arrives, so a header's promise alone allocates nothing."""
        held = self._buffer[self._start : self._end]
        if self._end == len(self._buffer):
            if len(held) == len(self._buffer):
                self._buffer = memoryview(bytearray(2 * len(held)))
            self._buffer[: len(held)] = held
            self._start, self._end = 0, len(held)
        count = self._read_into(self._buffer[self._end :])
        if count == 0:
            raise DataError(
                Reason.ARCHIVE_TRUNCATED,
                f"{self._where}: the tar ends after {self.position + len(held)} bytes, in a member; download it again",
                {"position_bytes": self.position, "wanted_bytes": size, "left_bytes": len(held)},
            )
        self._end += count

    def _read_into(self, target: memoryview) -> int:
        try:
            return int(self._reader.readinto(target))
        except EOFError as error:
            reason, what = Reason.ARCHIVE_TRUNCATED, f"the gzip stream ends without its end marker ({error})"
        except (gzip.BadGzipFile, zlib_ng.error) as error:  # type: ignore[misc]
            reason, what = Reason.ARCHIVE_CORRUPT, f"the gzip stream is damaged ({error})"
        message = f"{self._where}: {what}, after {self.position} bytes of content; download it again"
        raise DataError(reason, message, {"position_bytes": self.position})


@contextmanager
def open_gzip(path: Path, where: str) -> Iterator[GzipStream]:
    """Open a gzip file.

    Args:
        path: the file.
        where: what to call it in messages.

    Raises:
        DataError: `archive.pointer_file`, `archive.truncated` for a file of no bytes, `archive.not_gzip`.
    """
    with path.open("rb", buffering=0) as file:
        head = file.read(len(_POINTER))
        if head == _POINTER:
            raise DataError(
                Reason.ARCHIVE_POINTER_FILE,
                f"{where} must be an archive, but it is the text pointer that a clone without large-file support "
                "leaves; fetch the file itself with `git lfs pull`",
            )
        if head[:2] != _GZIP_MAGIC[: len(head)]:
            raise DataError(
                Reason.ARCHIVE_NOT_GZIP,
                f"{where} must be a gzip file and start with 1f 8b, found {head[:2].hex(' ')}; download it again",
                {"first_bytes": head[:2].hex()},
            )
        if len(head) < len(_GZIP_MAGIC):
            raise DataError(Reason.ARCHIVE_TRUNCATED, f"{where} has {len(head)} bytes; download it again")
        file.seek(0)
        yield GzipStream(file, where)
