"""Depth as the codec sees it: clipped, logarithmic, replicated to three channels; and back to metres.

u = log(d / d_min) / log(d_max / d_min) with d clipped to [d_min, d_max]; the video is 2u - 1 (the paper, appendix,
"Depth"). The paper is silent about pixels without a measurement: here they become d_max before encoding, that is +1,
and the share of measured pixels in each latent cell is stored beside the latents.
"""

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array, Uint8Array, Uint16Array, require_array
from wsm_data.schema.depth import DepthEncoding, DepthRange
from wsm_data.schema.sequence import TEMPORAL_RATIO

_RAW_CODES = 1 << 16
_FULL_SHARE = 255

UNMEASURED = 1.0
"""Normalised depth of a pixel without a measurement: that of d_max."""


def normalise_depth(depth_m: NDArray[np.floating], depth_range: DepthRange) -> Float32Array:
    """Depth in metres, any shape, to 2u - 1 in [-1, 1]; what is 0, negative or not finite becomes +1."""
    depth = np.asarray(depth_m, np.float64)
    measured = np.isfinite(depth) & (depth > 0)
    clipped = np.clip(np.where(measured, depth, depth_range.max_m), depth_range.min_m, depth_range.max_m)
    u = np.log(clipped / depth_range.min_m) / np.log(depth_range.max_m / depth_range.min_m)
    return (2 * u - 1).astype(np.float32)


def log_depth_table(encoding: DepthEncoding, depth_range: DepthRange) -> Float32Array:
    """The normalised depth 2u - 1 of every raw code, float32 [65536]; codes without a measurement hold +1."""
    return normalise_depth(depth_m_from_raw(np.arange(_RAW_CODES, dtype=np.uint16), encoding), depth_range)


def measured_table(encoding: DepthEncoding) -> BoolArray:
    """Whether each raw code is a measurement, bool [65536]."""
    return is_measured(np.arange(_RAW_CODES, dtype=np.uint16), encoding)


def depth_m_from_raw(raw_u16: Uint16Array, encoding: DepthEncoding) -> Float32Array:
    """Depth of raw codes in metres along the optical axis, float32 in the shape of `raw_u16`; 0 = no measurement.

    The product is formed in float64 and rounded once, so it does not depend on how `metres_per_unit` rounds to float32.
    """
    return _metres_table(encoding)[raw_u16]


@lru_cache(maxsize=4)
def _metres_table(encoding: DepthEncoding) -> Float32Array:
    codes = np.arange(_RAW_CODES, dtype=np.uint16)
    depth_m = (codes * np.float64(encoding.metres_per_unit)).astype(np.float32)
    depth_m[~is_measured(codes, encoding)] = 0
    return depth_m


def is_measured(raw_u16: Uint16Array, encoding: DepthEncoding) -> BoolArray:
    """Whether each raw code is a measurement, in the shape of `raw_u16`."""
    measured = np.ones(raw_u16.shape, bool)
    for code in encoding.invalid_codes:
        measured &= raw_u16 != code
    return measured


def depth_m_from_latent_video(video: Float32Array, depth_range: DepthRange) -> Float32Array:
    """Decoded depth video [T, H, W, 3] to metres, float32 [T, H, W]: mean of the channels, clamp, inverse of the log.

    Pixels without a measurement were encoded as d_max and come back near it; `valid_share` tells them apart.
    """
    require_array("video", video, np.float32, (None, None, None, 3))
    u: Float64Array = (np.clip(video.mean(axis=-1, dtype=np.float64), -1, 1) + 1) / 2
    depth_m = (depth_range.min_m * (depth_range.max_m / depth_range.min_m) ** u).astype(np.float32)
    return np.clip(depth_m, np.float32(depth_range.min_m), np.float32(depth_range.max_m))


def valid_share(valid: BoolArray, spatial_ratio: int = 16) -> Uint8Array:
    """Share of valid pixels in each latent cell, 0..255.

    Args:
        valid: which pixels hold a measurement; bool [T, H, W], T = 1 + 4k, sides multiples of `spatial_ratio`.
        spatial_ratio: pixels of a latent cell's side.

    Returns:
        uint8 [F, h, w]: latent 0 counts frame 0, latent j >= 1 frames 4j - 3 .. 4j. The share times 255 is rounded to
        the nearest, halves to even.

    Raises:
        ValueError: the length or a side does not fit.
    """
    require_array("valid", valid, np.bool_, (None, None, None))
    frames, height, width = valid.shape
    if frames % TEMPORAL_RATIO != 1 or height % spatial_ratio or width % spatial_ratio:
        raise ValueError(f"valid must be [1 + 4k, {spatial_ratio} h, {spatial_ratio} w], found {list(valid.shape)}")
    in_frame = _count_cells(np.ascontiguousarray(valid).view(np.uint8), spatial_ratio)
    later = in_frame[1:].reshape(-1, TEMPORAL_RATIO, *in_frame.shape[1:]).sum(axis=1)
    per_frame = spatial_ratio**2
    shares = np.concatenate([in_frame[:1] / per_frame, later / (TEMPORAL_RATIO * per_frame)])
    return np.rint(shares * _FULL_SHARE).astype(np.uint8)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _count_cells(ones: Uint8Array, side: int) -> NDArray[np.int64]:
    """Sums over square cells of every frame; int64 [T, H / side, W / side]."""
    frames, height, width = ones.shape
    counts = np.zeros((frames, height // side, width // side), np.int64)
    column_sums = np.empty(width, np.uint32)
    for frame in range(frames):
        for row in range(counts.shape[1]):
            column_sums[:] = 0
            for y in range(row * side, (row + 1) * side):
                for x in range(width):
                    column_sums[x] += ones[frame, y, x]
            for x in range(width):
                counts[frame, row, x // side] += column_sums[x]
    return counts
