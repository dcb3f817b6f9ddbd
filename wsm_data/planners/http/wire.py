"""The bytes of pictures, depth and goals in a request.

The frames of B environments are stacked along the height. A client of the benchmark hands RGB to an encoder that
expects BGR, so red and blue are exchanged in the file, and servers exchange them back.
"""

import json
from collections.abc import Mapping
from typing import Any, NoReturn

import cv2
import numpy as np
import simplejpeg

from wsm_data.codecs.images import decode_depth, decode_rgb
from wsm_data.errors import DataError
from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array, require_array

JPEG_QUALITY = 95
DEPTH_CODES_PER_M = 10000.0
FARTHEST_CODE = 65535
"""Depth of 6.5535 m, of anything beyond, and of nothing hit at all."""
MOST_PIXELS = 64 << 20
"""Of a file, all environments together."""


def encode_image(rgb_u8: Uint8Array) -> bytes:
    """Pictures [B, H, W, 3] as one JPEG of [B*H, W] whose red and blue are exchanged."""
    require_array("rgb_u8", rgb_u8, np.uint8, (None, None, None, 3))
    _, data = cv2.imencode(".jpg", _stacked(rgb_u8), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return bytes(data)


def decode_image(data: bytes, batch: int) -> Uint8Array:
    """Inverse of `encode_image` up to the JPEG's loss; rgb_u8 [B, H, W, 3].

    Raises:
        WireError: `malformed`, or `wrong_batch` where the height is no multiple of `batch`.
    """
    try:
        height, width, *_ = simplejpeg.decode_jpeg_header(data, strict=True)
        _require_size(height, width, "image")
        exchanged = decode_rgb(data, "image")
    except (ValueError, DataError) as error:
        raise WireError(Fault.MALFORMED, str(error)) from error
    return np.ascontiguousarray(_unstacked(exchanged, batch, "image")[..., ::-1])


def encode_depth(depth_m: Float32Array) -> bytes:
    """Depth [B, H, W] (m, infinite where nothing was hit) as one 16-bit PNG of [B*H, W].

    A code is trunc(clip(10000 d, 0, 65535)), in single precision, as the benchmark's depth is.

    Raises:
        ValueError: a depth is not a number, for which the protocol has no code.
    """
    require_array("depth_m", depth_m, np.float32, (None, None, None))
    if np.isnan(depth_m).any():
        raise ValueError("depth_m must be numbers, and infinite where nothing was hit; found NaN")
    codes = np.clip(_stacked(depth_m) * np.float32(DEPTH_CODES_PER_M), 0, FARTHEST_CODE).astype(np.uint16)
    _, data = cv2.imencode(".png", codes)
    return bytes(data)


def decode_depth_m(data: bytes, batch: int) -> Float32Array:
    """Depth as servers of the benchmark read it, code / 10000, m: what is farther, or nowhere, is at 6.5535 m.

    Raises:
        WireError: `malformed`, or `wrong_batch` where the height is no multiple of `batch`.
    """
    width, height = (int.from_bytes(data[start : start + 4], "big") for start in (16, 20))  # where a PNG says it
    _require_size(height, width, "depth")
    try:
        codes = decode_depth(data, "depth")
    except DataError as error:
        raise WireError(Fault.MALFORMED, str(error)) from error
    return _unstacked((codes / DEPTH_CODES_PER_M).astype(np.float32), batch, "depth")


def encode_goals(goals_xy_m: Float64Array) -> str:
    """Goals [B, 2] (m, x forward, y left) as the text of `goal_data`."""
    return json.dumps({"goal_x": goals_xy_m[:, 0].tolist(), "goal_y": goals_xy_m[:, 1].tolist()})


def decode_goals(text: str | bytes, batch: int) -> Float64Array:
    """Inverse of `encode_goals`; float64 [B, 2].

    Raises:
        WireError: `malformed`, `not_finite`, or `wrong_batch` where there are not `batch` goals.
    """
    record = read_object(text, "goal_data")
    return np.stack([read_numbers(record, name, (batch,)) for name in ("goal_x", "goal_y")], axis=1)


def read_object(text: str | bytes, where: str) -> Mapping[str, Any]:
    """A JSON object, in which NaN and infinity are no numbers.

    Raises:
        WireError: `malformed`, or `not_finite`.
    """

    def refuse(word: str) -> NoReturn:
        raise WireError(Fault.NOT_FINITE, f"{where} must hold finite numbers, found {word}")

    try:
        record = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise WireError(Fault.MALFORMED, f"{where} must be JSON, but {error}; it begins {text[:60]!r}") from error
    if not isinstance(record, dict):
        raise WireError(Fault.MALFORMED, f"{where} must be a JSON object, found a {type(record).__name__}")
    return record


def read_numbers(record: Mapping[str, Any], name: str, shape: tuple[int | None, ...]) -> Float64Array:
    """Nested lists of numbers as an array, where None in `shape` stands for any length; the first is the batch.

    Raises:
        WireError: `malformed`, `not_finite`, or `wrong_batch` where the first length is another.
    """
    if name not in record:
        raise WireError(Fault.MALFORMED, f"{name!r} is missing; there is {', '.join(sorted(record)) or 'nothing'}")
    try:
        found = np.array(record[name])
    except ValueError as error:  # lists of different lengths
        raise WireError(Fault.MALFORMED, f"{name} must be an array of numbers, but {error}") from error
    wanted = f"[{', '.join('any' if one is None else str(one) for one in shape)}]"
    if found.dtype.kind not in "iuf" or found.ndim != len(shape):
        raise WireError(
            Fault.MALFORMED, f"{name} must be numbers {wanted}, found {found.dtype.name} {list(found.shape)}"
        )
    if shape[0] is not None and len(found) != shape[0]:
        raise WireError(Fault.WRONG_BATCH, f"{name} must be {wanted}, found {list(found.shape)}")
    if any(one not in (None, length) for one, length in zip(shape, found.shape, strict=True)):
        raise WireError(Fault.MALFORMED, f"{name} must be {wanted}, found {list(found.shape)}")
    numbers = found.astype(np.float64)
    if not np.isfinite(numbers).all():
        raise WireError(Fault.NOT_FINITE, f"{name} must be finite")
    return numbers


def _require_size(height: int, width: int, name: str) -> None:
    """Check what a file says of its size, before anything of that size is made."""
    if height * width > MOST_PIXELS:
        raise WireError(Fault.TOO_LARGE, f"{name} must have at most {MOST_PIXELS} pixels, found {width} x {height}")


def _stacked(frames: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(frames.reshape(-1, *frames.shape[2:]))


def _unstacked(image: np.ndarray, batch: int, name: str) -> np.ndarray:
    height, rest = divmod(len(image), batch)
    if rest:
        raise WireError(
            Fault.WRONG_BATCH, f"{name} must be {batch} frames one below the other, found {len(image)} rows in all"
        )
    return image.reshape(batch, height, *image.shape[1:])
