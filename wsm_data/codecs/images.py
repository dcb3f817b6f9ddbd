"""From one stored frame to its pixels."""

import cv2
import numpy as np
import simplejpeg

from wsm_data.codecs.png16 import decode_png16
from wsm_data.codecs.png_chunks import PNG_SIGNATURE, has_right_checksums
from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import Uint8Array, Uint16Array, require_array
from wsm_data.schema.frames import DepthFrame, RgbFrame


def rgb_pixels(frame: RgbFrame, where: str) -> Uint8Array:
    """The pixels of a colour frame, rgb_u8 [H, W, 3]: decoded where it is a file, itself where its reader did that.

    Raises:
        DataError: FRAME_UNDECODABLE.
        ValueError: pixels of another type or shape: a reader's fault.
    """
    if isinstance(frame, bytes):
        return decode_rgb(frame, where)
    require_array(where, frame, np.uint8, (None, None, 3))
    return frame


def depth_codes(frame: DepthFrame, where: str) -> Uint16Array:
    """The raw codes of a depth frame, uint16 [H, W]: decoded where it is a file, itself where its reader did that.

    Raises:
        DataError: FRAME_UNDECODABLE, DEPTH_NOT_16_BIT.
        ValueError: codes of another type or shape: a reader's fault.
    """
    if isinstance(frame, bytes):
        return decode_depth(frame, where)
    require_array(where, frame, np.uint16, (None, None))
    return frame


def decode_rgb(data: bytes, where: str) -> Uint8Array:
    """Decode a JPEG or a PNG of 8-bit colours, rgb_u8 [H, W, 3].

    What libjpeg warns of is refused here: a file that ends early or lost its place would otherwise come back with its
    rest in grey. A flipped bit that leaves a well-formed stream cannot be seen by any decoder.

    Args:
        data: the bytes of the file.
        where: unit and frame, for the message.

    Raises:
        DataError: FRAME_UNDECODABLE.
    """
    if data.startswith(PNG_SIGNATURE):
        return _decode_colour_png(data, where)
    try:
        return simplejpeg.decode_jpeg(data, "RGB", strict=True)
    except ValueError as error:
        raise _undecodable("colour", "a complete JPEG", data, where, str(error)) from error


def _decode_colour_png(data: bytes, where: str) -> Uint8Array:
    """Decode a PNG after its checksums were found right, for OpenCV shows what it can of a damaged one."""
    if not has_right_checksums(data):
        raise _undecodable("colour", "a complete PNG", data, where, "a checksum does not fit")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        found = "the decoder gave up" if image is None else f"it holds {image.dtype} {list(image.shape)}"
        raise _undecodable("colour", "a PNG of 8-bit red, green and blue", data, where, found)
    return np.ascontiguousarray(image[..., ::-1])


def decode_depth(data: bytes, where: str) -> Uint16Array:
    """Decode a 16-bit grey PNG, uint16 [H, W] in the raw codes of the source.

    OpenCV has the last word on what is not plain and whole: what other kinds of PNG hold, and what is damaged.

    Args:
        data: the bytes of the file.
        where: unit and frame, for the message.

    Raises:
        DataError: FRAME_UNDECODABLE, or DEPTH_NOT_16_BIT where the image has 8 bits or several channels.
    """
    plain = decode_png16(data)
    if plain is not None:
        return plain
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:  # an empty buffer
        raise _undecodable("depth", "a complete 16-bit grey PNG", data, where, str(error).strip()) from error
    if image is None:
        raise _undecodable("depth", "a complete 16-bit grey PNG", data, where, "the decoder gave up")
    if image.dtype != np.uint16 or image.ndim != 2:
        found = f"{image.dtype} {list(image.shape)}"
        message = f"{where}: a depth image must be 16-bit grey, found {found}; was a preview stored instead of depth?"
        raise DataError(Reason.DEPTH_NOT_16_BIT, message, {"dtype": str(image.dtype), "shape": list(image.shape)})
    return image


def _undecodable(kind: str, wanted: str, data: bytes, where: str, cause: str) -> DataError:
    message = f"{where}: a {kind} image must be {wanted}, found {len(data)} bytes that do not decode ({cause})"
    return DataError(Reason.FRAME_UNDECODABLE, f"{message}; fetch the file again", {"size_bytes": len(data)})
