"""From decoded frames to the pixels that a codec encodes: resized and normalised in one pass over the memory."""

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float32Array, Uint8Array, Uint16Array

_HALF_RANGE = 127.5
_LEVELS = 255


def resize_colour(rgb_u8: Uint8Array, out: Float32Array) -> None:
    """Resize by the mean over each target pixel's area, and bring 0..255 to [-1, 1].

    A target pixel's area is its share of the image, along each axis as in `Intrinsics.resized`; parts of source pixels
    count by their share. Weights are whole numbers, so the mean is exact and is rounded once, to float32: black is -1
    and white 1 to the bit, on every machine. Nothing is rounded to 256 levels in between.

    Args:
        rgb_u8: the frame; uint8 [H, W, 3].
        out: where it is put; float32 [height, width, 3].
    """
    rgb_u8 = _two_at_least(rgb_u8)
    first_row, row_weights = _area_weights(rgb_u8.shape[0], out.shape[0])
    first_column, column_weights = _area_weights(rgb_u8.shape[1], out.shape[1])
    area = int(row_weights[:, 0].sum()) * int(column_weights[:, 0].sum())
    exact = np.int32 if area * _LEVELS <= np.iinfo(np.int32).max else np.int64
    rows, columns = row_weights.astype(exact, copy=False), column_weights.astype(exact, copy=False)
    half_range = np.float32(_HALF_RANGE * area)
    _area_means(rgb_u8, first_row, rows, first_column, columns, half_range, out)


def resize_depth(
    raw_u16: Uint16Array, normalised: Float32Array, measured: BoolArray, out: Float32Array, valid: BoolArray
) -> None:
    """Take for each target pixel the source pixel in which its centre lies, and look its code up.

    An average would invent surfaces between a table's edge and the wall behind it, and would mix the codes that mean
    "no measurement" into distances. Pixel areas scale as in `Intrinsics.resized`, so target x reads source
    floor((x + 1/2) s) with s = source width / target width, in whole numbers: OpenCV's fixed point falls to either side
    where a centre lies on the border of two pixels, as all do from 640 to 320.

    Args:
        raw_u16: the frame in the raw codes of the source; uint16 [H, W].
        normalised: what every code becomes; float32 [65536].
        measured: which codes are measurements; bool [65536].
        out: where the depth is put; float32 [height, width].
        valid: where it is put which pixels hold a measurement; bool [height, width].
    """
    rows, columns = (_centre_pixels(before, after) for before, after in zip(raw_u16.shape, out.shape, strict=True))
    _look_up(np.ascontiguousarray(raw_u16), rows, columns, normalised, measured, out, valid)


def _two_at_least(image: Uint8Array) -> Uint8Array:
    """The same picture with at least two rows and columns."""
    rows, columns = (1 if size > 1 else 2 for size in image.shape[:2])
    return np.ascontiguousarray(image if rows == columns == 1 else image.repeat(rows, axis=0).repeat(columns, axis=1))


@lru_cache(maxsize=16)
def _centre_pixels(before: int, after: int) -> NDArray[np.int64]:
    """The source pixel in which the centre of each target pixel lies."""
    return (2 * np.arange(after) + 1) * before // (2 * after)


@lru_cache(maxsize=16)
def _area_weights(before: int, after: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The source pixels under each target pixel of an axis, in units of which both have whole numbers.

    Returns:
        first: the first of K >= 2 source pixels that are looked at; int64 [after], first + K <= before.
        weights: how much of each counts; int32 [K, after], columns add up to before / gcd(before, after).
    """
    divisor = np.gcd(before, after)
    source, target = after // divisor, before // divisor  # sizes of a pixel
    starts = np.arange(after) * target
    first = starts // source
    taps = int(((starts + target - 1) // source - first).max()) + 1
    taps = max(taps, 2)
    first = np.minimum(first, before - taps)
    pixels = first + np.arange(taps)[:, None]
    low, high = np.maximum(pixels * source, starts), np.minimum((pixels + 1) * source, starts + target)
    return first, np.maximum(high - low, 0).astype(np.int32)


@njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _area_means(
    rgb_u8: Uint8Array,
    first_row: NDArray[np.int64],
    row_weights: NDArray[np.signedinteger],
    first_column: NDArray[np.int64],
    column_weights: NDArray[np.signedinteger],
    half_range: np.float32,
    out: Float32Array,
) -> None:
    """Rows first, then columns, in whole numbers; the first two of K are always there, which spares passes."""
    rows, columns = rgb_u8.shape[0], 3 * rgb_u8.shape[1]
    height, width = out.shape[0], out.shape[1]
    source, target = rgb_u8.reshape(rows, columns), out.reshape(height, 3 * width)
    wide = np.empty(columns, row_weights.dtype)
    narrow = np.empty(3 * width, row_weights.dtype)
    for y in range(height):
        one, two = source[first_row[y]], source[first_row[y] + 1]
        v, w = row_weights[0, y], row_weights[1, y]
        for i in range(columns):
            wide[i] = v * row_weights.dtype.type(one[i]) + w * row_weights.dtype.type(two[i])
        for k in range(2, len(row_weights)):
            w = row_weights[k, y]
            if w:
                one = source[first_row[y] + k]
                for i in range(columns):
                    wide[i] += w * row_weights.dtype.type(one[i])
        for x in range(width):
            v, w, i = column_weights[0, x], column_weights[1, x], 3 * first_column[x]
            narrow[3 * x] = v * wide[i] + w * wide[i + 3]
            narrow[3 * x + 1] = v * wide[i + 1] + w * wide[i + 4]
            narrow[3 * x + 2] = v * wide[i + 2] + w * wide[i + 5]
        for k in range(2, len(column_weights)):
            for x in range(width):
                w, i = column_weights[k, x], 3 * (first_column[x] + k)
                narrow[3 * x] += w * wide[i]
                narrow[3 * x + 1] += w * wide[i + 1]
                narrow[3 * x + 2] += w * wide[i + 2]
        for i in range(3 * width):
            target[y, i] = (np.float32(narrow[i]) - half_range) / half_range


@njit(cache=True)  # type: ignore[untyped-decorator]
def _look_up(
    raw_u16: Uint16Array,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    normalised: Float32Array,
    measured: BoolArray,
    out: Float32Array,
    valid: BoolArray,
) -> None:
    for y in range(len(rows)):
        source, target, flags = raw_u16[rows[y]], out[y], valid[y]
        for x in range(len(columns)):
            code = source[columns[x]]
            target[x] = normalised[code]
            flags[x] = measured[code]
