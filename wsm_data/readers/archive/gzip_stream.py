"""The decompressed bytes of a gzip file in one reused buffer: nothing is allocated or copied for each member."""

import gzip
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from zlib_ng import gzip_ng, zlib_ng

from wsm_data.errors import DataError, Reason
from wsm_data.readers.unreadable import refusing_unreadable

_BUFFER_BYTES = 1 << 19
_GZIP_MAGIC = b"\x1f\x8b"
_POINTER = b"version https://git-lfs"
_OTHER_ARCHIVES = {
    b"PK": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "Zstandard",
    b"7z\xbc\xaf": "7-Zip",
}
_TAR_MAGIC_AT = 257


class GzipStream:
    """Sequential access to the content of a gzip file, several gzip members in a row included."""

    def __init__(self, file: BinaryIO, where: str):
        self._reader = _reader(file)
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


def _reader(file: BinaryIO) -> io.RawIOBase | gzip_ng.GzipNGFile:
    """The reader behind `gzip_ng.open`, taken directly: `GzipNGFile.readinto` reads into new bytes and copies them.

    It is not a public name, so that a zlib-ng without it is served by the public reader: the same bytes, slower.
    """
    direct = getattr(zlib_ng, "_GzipReader", None)
    return gzip_ng.GzipNGFile(fileobj=file, mode="rb") if direct is None else direct(file, _BUFFER_BYTES)


@contextmanager
def open_gzip(path: Path, where: str) -> Iterator[GzipStream]:
    """Open a gzip file.

    Args:
        path: the file.
        where: what to call it in messages.

    Raises:
        DataError: `archive.pointer_file`, `archive.truncated` for a file of no bytes, `archive.not_gzip`,
            `file.unreadable`.
    """
    with refusing_unreadable(where), path.open("rb", buffering=0) as file:
        head = file.read(len(_POINTER))
        if head == _POINTER:
            raise DataError(
                Reason.ARCHIVE_POINTER_FILE,
                f"{where} must be an archive, but it is the text pointer that a clone without large-file support "
                "leaves; fetch the file itself with `git lfs pull`",
            )
        if head[:2] != _GZIP_MAGIC[: len(head)]:
            raise _not_gzip(head + file.read(_TAR_MAGIC_AT + 5 - len(head)), where)
        if len(head) < len(_GZIP_MAGIC):
            raise DataError(Reason.ARCHIVE_TRUNCATED, f"{where} has {len(head)} bytes; download it again")
        file.seek(0)
        yield GzipStream(file, where)


def _not_gzip(head: bytes, where: str) -> DataError:
    """Refusal of a file that is another kind of archive, or none."""
    kind = next((kind for start, kind in _OTHER_ARCHIVES.items() if head.startswith(start)), None)
    if head[_TAR_MAGIC_AT:] == b"ustar":
        kind = "uncompressed tar"
    if kind is None:
        message = f"{where} must be a gzip file and start with 1f 8b, found {head[:2].hex(' ')}; download it again"
    else:
        message = (
            f"{where} must be a .tar.gz, and is a {kind} archive: only .tar.gz archives are read; unpack it into a "
            "folder <group>/<scene>, which is read as it is, or pack it anew with `tar -czf`"
        )
    return DataError(Reason.ARCHIVE_NOT_GZIP, message, {"first_bytes": head[:2].hex(), "kind": kind})
