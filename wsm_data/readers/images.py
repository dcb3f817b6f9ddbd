"""Structural checks of image files: whole, of the right kind, and how large; nothing is decoded.

A file that passes can still hold damaged pixels: decoding says so later. What these checks catch is what happens to
real downloads, at the price of reading a few bytes of each image.
"""

import struct

from wsm_data.codecs.png_chunks import PNG_SIGNATURE
from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.tar_stream import POINTER_START

_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_JPEG_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # SOF0..15 less DHT, JPG and DAC
_JPEG_BARE_MARKERS = frozenset((0x01, *range(0xD0, 0xD8)))  # TEM and RSTn carry no length
_PNG_END = b"\x00\x00\x00\x00IEND\xaeB`\x82"
_PNG_HEADER = struct.Struct(">8sI4sIIBB")  # signature, length, type; width, height, bit depth, colour type
_PNG_GREY, _PNG_RGB = 0, 2


def check_jpeg(data: memoryview, where: str) -> tuple[int, int]:
    """Return (width, height) of a JPEG file that is whole.

    Raises:
        DataError: `frame.empty`, `frame.undecodable` when it is no JPEG, `frame.truncated` when its end is absent.
    """
    _require_start(data, _JPEG_START, "JPEG", where)
    if data[-2:] != _JPEG_END:
        raise _truncated(where, "a JPEG ends with ff d9", bytes(data[-2:]))
    position = len(_JPEG_START)
    while position + 9 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if marker in _JPEG_FRAME_MARKERS:
            height, width = struct.unpack_from(">HH", data, position + 5)
            return width, height
        if marker == 0xFF:  # a fill byte before a marker
            position += 1
        elif marker in _JPEG_BARE_MARKERS:
            position += 2
        else:
            position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    message = f"{where}: a JPEG states its size in a start-of-frame segment, and none was found; download it again"
    raise DataError(Reason.FRAME_UNDECODABLE, message, {"bytes": len(data)})


def check_png16(data: memoryview, where: str) -> tuple[int, int]:
    """Return (width, height) of a 16-bit grey PNG file that is whole.

    Raises:
        DataError: `frame.empty`, `frame.undecodable` when it is no PNG, `frame.truncated` when its end is absent,
            `depth.not_16_bit` when it is any other kind of PNG.
    """
    width, height, bits, colour = _png_header(data, where)
    if (bits, colour) != (16, _PNG_GREY):
        raise DataError(
            Reason.DEPTH_NOT_16_BIT,
            f"{where}: depth must be a grey PNG of 16 bits, found {bits} bits of colour type {colour}; an 8-bit image "
            "is a picture of depth, not a measurement",
            {"bits": bits, "colour_type": colour},
        )
    return width, height


def check_rgb(data: memoryview, where: str) -> tuple[int, int]:
    """Return (width, height) of a colour image that is whole: a JPEG, or a PNG of 8-bit red, green and blue.

    Raises:
        DataError: `frame.empty`, `frame.undecodable` when it is neither, `frame.truncated` when its end is absent.
    """
    if data[: len(PNG_SIGNATURE)] != PNG_SIGNATURE:
        return check_jpeg(data, where)
    width, height, bits, colour = _png_header(data, where)
    if (bits, colour) != (8, _PNG_RGB):
        raise DataError(
            Reason.FRAME_UNDECODABLE,
            f"{where}: a colour PNG must have 8 bits of red, green and blue, found {bits} bits of colour type {colour}",
            {"bits": bits, "colour_type": colour},
        )
    return width, height


def _png_header(data: memoryview, where: str) -> tuple[int, int, int, int]:
    """Width, height, bits and colour type of a PNG that is whole."""
    _require_start(data, PNG_SIGNATURE, "PNG", where)
    if data[-len(_PNG_END) :] != _PNG_END:
        raise _truncated(where, "a PNG ends with an IEND chunk", bytes(data[-4:]))
    if len(data) < _PNG_HEADER.size or bytes(data[12:16]) != b"IHDR":
        message = f"{where}: a PNG starts with an IHDR chunk, and none was found; download it again"
        raise DataError(Reason.FRAME_UNDECODABLE, message, {"bytes": len(data)})
    *_, width, height, bits, colour = _PNG_HEADER.unpack_from(data)
    return width, height, bits, colour


def require_pixels(size: tuple[int, int], max_pixels: int, where: str) -> None:
    """Check the declared width and height of an image before anything decodes it.

    Raises:
        DataError: `frame.too_large`.
    """
    width, height = size
    if width * height > max_pixels:
        raise DataError(
            Reason.FRAME_TOO_LARGE,
            f"{where}: an image must have at most {max_pixels:,} pixels, and declares {width} x {height}; if it is "
            "right, raise max_image_pixels in [limits] of the manifest",
            {"width": width, "height": height, "limit": max_pixels},
        )


def _require_start(data: memoryview, start: bytes, kind: str, where: str) -> None:
    if len(data) == 0:
        raise DataError(Reason.FRAME_EMPTY, f"{where}: an image must not be empty, found 0 bytes; download it again")
    if data[: len(POINTER_START)] == POINTER_START:
        raise DataError(
            Reason.ARCHIVE_POINTER_FILE,
            f"{where} must be a {kind}, but it is the text pointer that a clone without large-file support leaves; "
            "fetch the file itself with `git lfs pull`",
        )
    if data[: len(start)] != start[: len(data)]:
        found = bytes(data[: len(start)]).hex(" ")
        message = f"{where}: a {kind} starts with {start.hex(' ')}, found {found}; download it again"
        raise DataError(Reason.FRAME_UNDECODABLE, message, {"first_bytes": found})


def _truncated(where: str, rule: str, found: bytes) -> DataError:
    message = f"{where}: {rule}, and this one ends with {found.hex(' ')}: it was cut; download it again"
    return DataError(Reason.FRAME_TRUNCATED, message, {"last_bytes": found.hex()})
