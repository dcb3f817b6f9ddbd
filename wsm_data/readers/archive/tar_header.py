"""One 512-byte tar header, and the pax records that may stand before it (POSIX.1-2001 "pax", ustar and GNU tar)."""

import zlib
from typing import NamedTuple

from wsm_data.errors import DataError, Reason

BLOCK_BYTES = 512
ZERO_BLOCK = bytes(BLOCK_BYTES)

_REGULAR = b"0\x007"  # "0" in ustar, NUL before it; "7" is a contiguous file, which nothing tells from another
_FOLDER = b"5"
_HARD_LINK = b"1"
_LABELS = b"V", b"D"  # GNU: the name of the volume, and a list of names in a folder
_LONG_NAME, _LONG_LINK, _PAX, _PAX_GLOBAL = b"L", b"K", b"x", b"g"
_CHECKSUM = slice(148, 156)
_MAX_DIGITS = 19  # of a number of 64 bits
_ADLER_MODULUS = 65521


class TarHeader(NamedTuple):
    """What a header says of the bytes that follow it.

    Attributes:
        name: path of the member.
        size: bytes of its content, before padding to whole blocks.
        kind: the type flag, one byte.
    """

    name: str
    size: int
    kind: bytes

    @property
    def is_file(self) -> bool:
        """A plain file; very old archives mark folders only by a `/` at the end of the name."""
        return self.kind in _REGULAR and not self.name.endswith("/")

    @property
    def is_folder(self) -> bool:
        """A folder, which holds no bytes."""
        return self.kind == _FOLDER or (self.kind in _REGULAR and self.name.endswith("/"))

    @property
    def is_label(self) -> bool:
        """GNU: the name of the volume, or what a folder held when it was packed; nothing is read of it."""
        return self.kind in _LABELS

    @property
    def is_hard_link(self) -> bool:
        """A second name of a file that came before it."""
        return self.kind == _HARD_LINK

    @property
    def is_long_name(self) -> bool:
        """GNU: the content is the name of the next member."""
        return self.kind == _LONG_NAME

    @property
    def is_long_link(self) -> bool:
        """GNU: the content is the link target of the next member, which is a link and will be refused."""
        return self.kind == _LONG_LINK

    @property
    def is_pax(self) -> bool:
        """The content holds pax records, for the next member or (global) for all that follow."""
        return self.kind in (_PAX, _PAX_GLOBAL)

    @property
    def is_global(self) -> bool:
        """The pax records hold for all members that follow."""
        return self.kind == _PAX_GLOBAL


def parse_header(block: memoryview, where: str) -> TarHeader:
    """Read one header block.

    Raises:
        DataError: `archive.corrupt` when its checksum or a number in it is wrong.
    """
    raw = bytes(block)
    stored = _number(raw[_CHECKSUM], where, "checksum")
    found = _byte_sum(raw[: _CHECKSUM.start] + b" " * 8 + raw[_CHECKSUM.stop :])  # its own field counts as spaces
    if stored % _ADLER_MODULUS != found:
        raise DataError(
            Reason.ARCHIVE_CORRUPT,
            f"{where}: the checksum of a tar header must be {found}, found {stored}; download the archive again",
            {"stored_checksum": stored, "computed_checksum": found},
        )
    name = _text(raw[:100])
    if raw[257:263] == b"ustar\0" and raw[345] != 0:  # GNU's own "ustar  " keeps times where ustar keeps the prefix
        name = f"{_text(raw[345:500])}/{name}"
    return TarHeader(name, _number(raw[124:136], where, "size"), raw[156:157])


def parse_pax(content: bytes, where: str) -> dict[str, str]:
    """Read pax records, each `<length> <key>=<value>` and a newline, the length counting itself.

    Raises:
        DataError: `archive.corrupt` when a length does not fit.
    """
    records, start = {}, 0
    while start < len(content):
        space = content.find(b" ", start)
        length = content[start:space] if space > 0 else b""
        end = start + int(length) if 0 < len(length) <= _MAX_DIGITS and length.isdigit() else 0
        key, separator, value = content[space + 1 : end - 1].partition(b"=")
        if not separator or end > len(content) or content[end - 1 : end] != b"\n":
            raise DataError(Reason.ARCHIVE_CORRUPT, f"{where}: a pax record is malformed; download the archive again")
        records[_decode(key)] = _decode(value)
        start = end
    return records


def long_name(content: bytes) -> str:
    """Text of a GNU long name."""
    return _text(content)


def _byte_sum(raw: bytes) -> int:
    """Sum of the bytes modulo 65521: the lower half of an Adler-32 that starts at 0, ten times as fast as `sum`."""
    return zlib.adler32(raw, 0) & 0xFFFF


def _text(field: bytes) -> str:
    return _decode(field.partition(b"\0")[0])


def _decode(name: bytes) -> str:
    return name.decode("utf-8", "backslashreplace")


def _number(field: bytes, where: str, what: str) -> int:
    """Octal digits, or GNU's big-endian binary with the top bit set for numbers that do not fit."""
    if field[0] & 0x80:
        return int.from_bytes(field, "big") - (1 << (8 * len(field) - 1))
    digits = field.partition(b"\0")[0].strip(b" ")
    try:
        return int(digits or b"0", 8)
    except ValueError as error:
        message = f"{where}: the {what} in a tar header must be an octal number, found {field!r}"
        raise DataError(Reason.ARCHIVE_CORRUPT, f"{message}; is it a tar archive? Download it again") from error
