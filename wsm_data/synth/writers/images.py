"""Frames as files: JPEG with a little sensor noise, and 16-bit PNG of depth."""

import struct

import numpy as np
import simplejpeg
from numba import njit
from numpy.typing import NDArray
from zlib_ng import zlib_ng

from wsm_data.schema.arrays import Float32Array, Uint8Array, Uint16Array

_SHIFTS = 64
_LARGEST_CODE = 65534  # 65535 is a code for "no measurement"
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_FILTER_UP = 2


def noise_tile(rng: np.random.Generator, height: int, width: int, sigma: float) -> NDArray[np.int16]:
    """Normal noise for frames of a size, and 64 rows and columns more, so that it can be shifted for each frame."""
    size = (height + _SHIFTS, width + _SHIFTS, 3)
    return np.round(sigma * rng.standard_normal(size, dtype=np.float32)).astype(np.int16)


def add_noise(rgb_u8: Uint8Array, tile: NDArray[np.int16], rng: np.random.Generator) -> Uint8Array:
    """The picture with the tile, shifted at random, added to it."""
    down, right = rng.integers(0, _SHIFTS, 2).tolist()
    height, width, _ = rgb_u8.shape
    noisy = np.empty_like(rgb_u8)
    _add_clipped(rgb_u8, tile[down : down + height, right : right + width], noisy)
    return noisy


@njit(cache=True)  # type: ignore[untyped-decorator]
def _add_clipped(picture: Uint8Array, noise: NDArray[np.int16], out: Uint8Array) -> None:
    height, width, channels = picture.shape
    for y in range(height):
        for x in range(width):
            for c in range(channels):
                out[y, x, c] = min(max(np.int64(picture[y, x, c]) + noise[y, x, c], 0), 255)


def encode_jpeg(rgb_u8: Uint8Array, quality: int) -> bytes:
    """The picture [H, W, 3] as JPEG with halved colour resolution, as cameras write it."""
    return bytes(simplejpeg.encode_jpeg(rgb_u8, quality=quality, colorspace="RGB", colorsubsampling="420"))


def depth_codes(depth_m: Float32Array, metres_per_unit: float) -> Uint16Array:
    """Depth in whole units, 0 where nothing was seen or where it is too far for 16 bits."""
    units = np.rint(depth_m.astype(np.float64) / metres_per_unit)
    return np.where(units <= _LARGEST_CODE, units, 0).astype(np.uint16)


def encode_png_16(codes: Uint16Array, level: int) -> bytes:
    """A 16-bit grey PNG [H, W]: every row less the row above it, deflated by zlib-ng.

    Several times as fast as libpng through OpenCV at the same size.
    """
    height, width = codes.shape
    samples = codes.astype(">u2").view(np.uint8).reshape(height, 2 * width)
    rows = np.empty((height, 1 + 2 * width), np.uint8)
    rows[:, 0] = _FILTER_UP
    rows[0, 1:] = samples[0]
    np.subtract(samples[1:], samples[:-1], out=rows[1:, 1:])
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib_ng.compress(rows.tobytes(), level)), (b"IEND", b"")]
    return _PNG_SIGNATURE + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib_ng.crc32(name + data))
