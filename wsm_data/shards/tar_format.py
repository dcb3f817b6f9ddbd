"""The tar and npy headers of a shard, written by hand: their bytes depend on the name and the size alone.

The standard library and numpy change such details between versions (device fields, room for growth), and `verify`
compares stored headers with newly made ones byte for byte. Sources: POSIX.1-2017, pax interchange format and ustar;
numpy's npy format, version 1.0.
"""

import re
from typing import Final

import numpy as np

from wsm_data.errors import DataError, Reason

BLOCK_BYTES: Final = 512
NPY_HEADER_BYTES: Final = 128
"""Every npy header is padded to this, so array data stands 128 bytes into a 512-byte block: 64-byte aligned."""

END_OF_ARCHIVE: Final = bytes(2 * BLOCK_BYTES)
MAX_KEY_BYTES: Final = 255
MAX_KEY_PART_BYTES: Final = 200  # a part is also a file name, which may grow by a suffix and stay below 255 bytes
_MAX_MEMBER_BYTES: Final = 8**11 - 1
_NAME_BYTES: Final = 100
_PREFIX_BYTES: Final = 155
_KEY_PART = re.compile(r"[A-Za-z0-9_%-]+")
_SKIPPED_BY_WEBDATASET = re.compile(r"__[^/]*__(/|$)")


def require_key(key: str, text: str) -> None:
    """Check that stock webdataset reads samples under this key, and that it can name a file.

    Args:
        key: key of a clip.
        text: the id it was made of, which stands in the index as UTF-8.

    Raises:
        DataError: `episode.unstorable_name`; the trajectory must be renamed at its source.
    """
    if len(key) > MAX_KEY_BYTES:
        raise _unstorable(key, f"is {len(key)} bytes long, at most {MAX_KEY_BYTES} are allowed")
    for part in key.split("/"):
        if not _KEY_PART.fullmatch(part):
            raise _unstorable(key, f"has the part {part!r}; parts hold letters, digits, '_', '-' and '%' only")
        if len(part) > MAX_KEY_PART_BYTES:
            raise _unstorable(key, f"has a part of {len(part)} bytes, at most {MAX_KEY_PART_BYTES} are allowed")
    if any("\ud800" <= letter <= "\udfff" for letter in text):  # what Python makes of bytes that are not UTF-8
        raise _unstorable(key, f"is made of {text!r}, which is not valid UTF-8")
    if _SKIPPED_BY_WEBDATASET.match(key):
        raise _unstorable(key, "starts with a name of the form __name__, which webdataset passes over")


def member_header(name: str, size: int) -> bytes:
    """Tar header of a regular file: mode 0644, owner 0, time 0; a multiple of 512 bytes.

    Names of up to 100 bytes stand in the header, longer ones are split at a `/` into ustar's prefix field, and what
    does not fit either way gets a pax `path` record in front.

    Raises:
        ValueError: the size does not fit the header's 11 octal digits, or the name is not ASCII.
    """
    if not 0 <= size <= _MAX_MEMBER_BYTES:
        raise ValueError(f"a tar member must have 0 to {_MAX_MEMBER_BYTES} bytes, found {size} for {name}")
    encoded = name.encode("ascii")
    split = _split_name(encoded)
    if split is not None:
        return _ustar_header(*split, size=size, kind=b"0", mode=0o644)
    record = _pax_record(b"path", encoded)
    return b"".join(
        [
            _ustar_header(b"././@PaxHeader", b"", size=len(record), kind=b"x", mode=0o644),
            record.ljust(padded(len(record)), b"\0"),
            _ustar_header(encoded[:_NAME_BYTES], b"", size=size, kind=b"0", mode=0o644),
        ]
    )


def padded(size: int) -> int:
    """Bytes that `size` bytes of data take in a tar: the next multiple of 512."""
    return -(-size // BLOCK_BYTES) * BLOCK_BYTES


def npy_header(dtype: np.dtype[np.generic], shape: tuple[int, ...]) -> bytes:
    """Header of an npy file, version 1.0, C order, of exactly 128 bytes.

    Raises:
        ValueError: the shape is too long to be described in 128 bytes.
    """
    axes = tuple(int(length) for length in shape)
    text = f"{{'descr': '{dtype.str}', 'fortran_order': False, 'shape': {axes}, }}".encode("ascii")
    room = NPY_HEADER_BYTES - 10
    if len(text) >= room:
        raise ValueError(f"an npy header must fit {NPY_HEADER_BYTES} bytes, found shape {axes}")
    return b"\x93NUMPY\x01\x00" + room.to_bytes(2, "little") + text.ljust(room - 1) + b"\n"


def _split_name(name: bytes) -> tuple[bytes, bytes] | None:
    """(name, prefix) as ustar stores them, or None where neither field takes it."""
    if len(name) <= _NAME_BYTES:
        return name, b""
    cut = name.rfind(b"/", 0, _PREFIX_BYTES + 1)
    if cut <= 0 or len(name) - cut - 1 > _NAME_BYTES:
        return None
    return name[cut + 1 :], name[:cut]


def _ustar_header(name: bytes, prefix: bytes, *, size: int, kind: bytes, mode: int) -> bytes:
    header = b"".join(
        [
            name.ljust(_NAME_BYTES, b"\0"),
            b"%07o\0" % mode,
            b"%07o\0" % 0,  # user id
            b"%07o\0" % 0,  # group id
            b"%011o\0" % size,
            b"%011o\0" % 0,  # time of change
            b" " * 8,  # the checksum counts its own field as blanks
            kind,
            bytes(100),  # link name
            b"ustar\x0000",
            bytes(32 + 32 + 8 + 8),  # owner, group, device numbers
            prefix.ljust(_PREFIX_BYTES, b"\0"),
            bytes(12),
        ]
    )
    return header[:148] + b"%06o\0 " % sum(header) + header[156:]


def _pax_record(key: bytes, value: bytes) -> bytes:
    """Length, blank, key, `=`, value, newline, where the length counts its own digits."""
    rest = len(key) + len(value) + 3
    length = rest + len(str(rest))
    length = rest + len(str(length))
    return b"%d %s=%s\n" % (length, key, value)


def _unstorable(key: str, what: str) -> DataError:
    return DataError(
        Reason.EPISODE_UNSTORABLE_NAME,
        f"the key of a clip must be readable by webdataset, but {key!r} {what}; rename the trajectory at its source",
        {"key": key},
    )
