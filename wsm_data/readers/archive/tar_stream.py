"""The bytes of a tar, compressed or not, in one reused buffer: nothing is allocated or copied for each member."""

import gzip
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import pyarrow as pa
from zlib_ng import gzip_ng, zlib_ng

from wsm_data.errors import DataError, Reason
from wsm_data.readers.unreadable import open_file

_BUFFER_BYTES = 1 << 19
_GZIP_MAGIC = b"\x1f\x8b"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_TAR_MAGIC = b"ustar"
POINTER_START = b"version https://git-lfs"
"""How the text begins that stands for a file in a clone without large-file support."""

_OTHER_ARCHIVES = {
    b"PK": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"Rar!": "RAR",
    b"7z\xbc\xaf": "7-Zip",
}
_TAR_MAGIC_AT = 257

READ_FORMS = "a .tar, .tar.gz, .tgz or .tar.zst"
PACK_ANEW = (
    "unpack it into a folder <group>/<scene>, which is read as it is, or pack that anew with `tar -czf <scene>.tar.gz`"
)
"""What to do with an archive in another form."""


class _Reader(Protocol):
    """What fills a buffer; 0 at the end."""

    def readinto(self, buffer: memoryview, /) -> int | None: ...


class TarStream:
    """Sequential access to a tar that `reader` decompresses."""

    def __init__(self, reader: _Reader, where: str):
        self._reader = reader
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
        """What remains, in pieces; reading it to the end verifies the checksum of the compression.

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
            return self._reader.readinto(target) or 0
        except EOFError as error:
            reason, what = Reason.ARCHIVE_TRUNCATED, f"the gzip stream ends without its end marker ({error})"
        except (gzip.BadGzipFile, zlib_ng.error) as error:  # type: ignore[misc]
            reason, what = Reason.ARCHIVE_CORRUPT, f"the gzip stream is damaged ({error})"
        except OSError as error:
            if error.errno is not None:
                raise  # the system's, not the decompressor's
            cut = "Truncated" in str(error)
            reason = Reason.ARCHIVE_TRUNCATED if cut else Reason.ARCHIVE_CORRUPT
            what = f"the Zstandard stream is damaged ({error})"
        message = f"{self._where}: {what}, after {self.position} bytes of content; download it again"
        raise DataError(reason, message, {"position_bytes": self.position})


def _reader(file: io.FileIO, head: bytes) -> _Reader | None:
    """The reader of a tar by its first bytes; None where they are those of no form that is read."""
    if head.startswith(_GZIP_MAGIC):
        return _gzip_reader(file)
    if head.startswith(_ZSTD_MAGIC):
        return pa.CompressedInputStream(pa.PythonFile(file, "r"), "zstd")
    return file if head[_TAR_MAGIC_AT:].startswith(_TAR_MAGIC) else None


def _gzip_reader(file: io.FileIO) -> io.RawIOBase | gzip_ng.GzipNGFile:
    """The reader behind `gzip_ng.open`, taken directly: `GzipNGFile.readinto` reads into new bytes and copies them.

    It is not a public name, so that a zlib-ng without it is served by the public reader: the same bytes, slower.
    """
    direct = getattr(zlib_ng, "_GzipReader", None)
    return gzip_ng.GzipNGFile(fileobj=file, mode="rb") if direct is None else direct(file, _BUFFER_BYTES)


@contextmanager
def open_tar(path: Path, where: str) -> Iterator[TarStream]:
    """Open a tar: plain, or compressed by gzip or Zstandard, as its first bytes say.

    Args:
        path: the file.
        where: what to call it in messages.

    Raises:
        DataError: `archive.pointer_file`, `archive.truncated` for a file of no bytes, `archive.unread_form` for another
            kind of archive, `archive.not_gzip` for one that is named as gzip, or none, `file.unreadable`,
            `file.not_regular`.
    """
    with open_file(path, where) as file:
        head = file.read(len(POINTER_START))
        if head == POINTER_START:
            raise DataError(
                Reason.ARCHIVE_POINTER_FILE,
                f"{where} must be an archive, but it is the text pointer that a clone without large-file support "
                "leaves; fetch the file itself with `git lfs pull`",
            )
        if len(head) < len(_GZIP_MAGIC):
            raise DataError(Reason.ARCHIVE_TRUNCATED, f"{where} has {len(head)} bytes; download it again")
        head += file.read(_TAR_MAGIC_AT + len(_TAR_MAGIC) - len(head))
        file.seek(0)
        reader = _reader(file, head)
        if reader is None:
            raise _unread(head, where)
        yield TarStream(reader, where)


def _unread(head: bytes, where: str) -> DataError:
    """Refusal of a file that is another kind of archive, or none."""
    kind = next((kind for start, kind in _OTHER_ARCHIVES.items() if head.startswith(start)), None)
    details = {"first_bytes": head[:2].hex(), "kind": kind}
    if kind is None:
        message = (
            f"{where} must be {READ_FORMS} and start with 1f 8b (gzip), 28 b5 2f fd (Zstandard) or a tar header, found "
            f"{head[:4].hex(' ')}; download it again"
        )
        return DataError(Reason.ARCHIVE_NOT_GZIP, message, details)
    message = f"{where} must be {READ_FORMS}, and is a {kind} archive; {PACK_ANEW}"
    is_named_gzip = where.lower().endswith((".gz", ".tgz"))  # then the name is what is wrong
    return DataError(Reason.ARCHIVE_NOT_GZIP if is_named_gzip else Reason.ARCHIVE_UNREAD_FORM, message, details)
