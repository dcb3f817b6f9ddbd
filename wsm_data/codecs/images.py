"""From the bytes of one stored frame to pixels at the encoded size."""

import cv2
import numpy as np
import simplejpeg

from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import Uint8Array, Uint16Array


def decode_rgb(data: bytes, where: str) -> Uint8Array:
    """Decode a JPEG, rgb_u8 [H, W, 3].

    What libjpeg warns of is refused here: a file that ends early or lost its place would otherwise come back with its
    rest in grey. A flipped bit that leaves a well-formed stream cannot be seen by any decoder.

    Args:
        data: the bytes of the file.
        where: unit and frame, for the message.

    Raises:
        DataError: FRAME_UNDECODABLE.
    """
    try:
        return simplejpeg.decode_jpeg(data, "RGB", strict=True)
    except ValueError as error:
        raise _undecodable("colour", "a complete JPEG", data, where, str(error)) from error


def decode_depth(data: bytes, where: str) -> Uint16Array:
    """Decode a 16-bit grey PNG, uint16 [H, W] in the raw codes of the source.

    Args:
        data: the bytes of the file.
        where: unit and frame, for the message.

    Raises:
        DataError: FRAME_UNDECODABLE, or DEPTH_NOT_16_BIT where the image has 8 bits or several channels.
    """
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


def resize_rgb(rgb_u8: Uint8Array, width: int, height: int) -> Uint8Array:
    """Resize per axis by the mean over each target pixel's area, rgb_u8 [height, width, 3]."""
    return cv2.resize(rgb_u8, (width, height), interpolation=cv2.INTER_AREA)


def resize_depth(raw_u16: Uint16Array, width: int, height: int) -> Uint16Array:
    """Take for each target pixel the source pixel in which its centre lies, uint16 [height, width].

    Every value that comes out went in. An average would invent surfaces between a table's edge and the wall behind it,
    and would mix the codes that mean "no measurement" into distances. Pixel areas scale as in `Intrinsics.resized`, so
    target x reads source floor((x + 1/2) s) with s = source width / target width, in whole numbers: OpenCV's fixed
    point falls to either side where a centre lies on the border of two pixels, as all do from 640 to 320.
    """
    rows = _source_indices(raw_u16.shape[0], height)
    columns = _source_indices(raw_u16.shape[1], width)
    return raw_u16[rows].take(columns, axis=1)


def _source_indices(before: int, after: int) -> np.ndarray:
    return (2 * np.arange(after) + 1) * before // (2 * after)
