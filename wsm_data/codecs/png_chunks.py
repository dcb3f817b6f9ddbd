"""Whether the checksums of a PNG file are right. After W3C, "PNG Specification (Third Edition)", section 5."""

import struct

from zlib_ng import zlib_ng

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"

_CHUNK = struct.Struct(">I4s")
_CHECKSUM_BYTES = 4


def has_right_checksums(data: bytes) -> bool:
    """Whether a file is a row of PNG chunks, each with the right checksum (CRC-32), and the last one ends it."""
    view, position, kind = memoryview(data), len(PNG_SIGNATURE), b""
    while position + _CHUNK.size + _CHECKSUM_BYTES <= len(data) and kind != b"IEND":
        length, kind = _CHUNK.unpack_from(data, position)
        end = position + _CHUNK.size + length
        stored = view[end : end + _CHECKSUM_BYTES]
        checked = view[position + _CHUNK.size - len(kind) : end]
        if len(stored) < _CHECKSUM_BYTES or zlib_ng.crc32(checked) != int.from_bytes(stored, "big"):
            return False
        position = end + _CHECKSUM_BYTES
    return kind == b"IEND" and position == len(data)
