"""Points of one frame of a depth video, moved into another by several motions, against the depth there."""

from collections.abc import Sequence

import numpy as np
from numba import njit

from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import Float32Array, Float64Array, Int64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange

MAX_EDGE = 0.1
"""Points at depth edges do not count: those where the logarithms of the four pixels around differ by more than this."""


def warp_errors(
    video: Float32Array,
    a: int,
    b: int,
    motions: Float64Array,
    intrinsics: Intrinsics,
    depth_range: DepthRange,
    points: int,
) -> Float64Array:
    """|log(predicted depth / depth there)| of points of frame a in frame b, by motion; float64 [N, M].

    Only points are told that frame b shows under all motions, away from edges and from the ends of the range, so that
    the columns can be compared.

    Args:
        video: normalised log-depth, 2u - 1, without measurement +1; float32 [T, H, W].
        a: the frame whose points are moved.
        b: the frame they are held against.
        motions: `T_b_a`; float64 [M, 4, 4].
        intrinsics: at the size of the video.
        depth_range: range of the video.
        points: about so many are looked at, on a square lattice.
    """
    _, height, width = video.shape
    stride = max(1, int(np.sqrt(height * width / points)))
    K = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
    span = np.log(depth_range.max_m / depth_range.min_m) / 2
    middle = np.log(depth_range.min_m) + span
    return np.asarray(_warp(video[a], video[b], stride, np.ascontiguousarray(motions), K, middle, span))


def pair_motions(
    T_world_camera: Float64Array, a: Int64Array, b: Int64Array, offsets: Sequence[tuple[int, int]]
) -> Float64Array:
    """`T_b_a` of pairs where frame a has the pose of so many frames later, and b that of so many; float64 [P, M, 4, 4].

    Args:
        T_world_camera: poses of all frames; float64 [T, 4, 4].
        a: the first frames of the pairs; int64 [P].
        b: the second.
        offsets: M times, of the pose of the first frame and of the second.
    """
    before, after = np.array(offsets).T
    motions: Float64Array = invert(T_world_camera)[b[:, None] + after] @ T_world_camera[a[:, None] + before]
    return motions


@njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _warp(
    one: Float32Array,
    other: Float32Array,
    stride: int,
    motions: Float64Array,
    K: Float64Array,
    middle: float,
    span: float,
) -> Float64Array:
    """`warp_errors`; depth is exp(middle + span * value), K is (fx, fy, cx, cy)."""
    height, width = one.shape
    errors = np.empty(((height // stride + 1) * (width // stride + 1), len(motions)))
    told = 0
    for row in range(stride // 2, height, stride):
        for column in range(stride // 2, width, stride):
            if not -1 < one[row, column] < 1:
                continue
            z = np.exp(middle + span * one[row, column])
            x, y = (column - K[2]) / K[0] * z, (row - K[3]) / K[1] * z
            shown = True
            for m in range(len(motions)):
                T = motions[m]
                ahead = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
                if not ahead > 0:
                    shown = False
                    break
                u = K[0] * (T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]) / ahead + K[2]
                v = K[1] * (T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]) / ahead + K[3]
                if not (u >= 0 and v >= 0 and u < width - 1 and v < height - 1):
                    shown = False
                    break
                left, top = int(u), int(v)
                p, q = other[top, left], other[top, left + 1]
                r, s = other[top + 1, left], other[top + 1, left + 1]
                low, high = min(p, q, r, s), max(p, q, r, s)
                if not (low > -1 and high < 1 and span * (high - low) <= MAX_EDGE):
                    shown = False
                    break
                x_share, y_share = u - left, v - top
                upper, lower = (1 - x_share) * p + x_share * q, (1 - x_share) * r + x_share * s
                there = middle + span * ((1 - y_share) * upper + y_share * lower)
                errors[told, m] = abs(np.log(ahead) - there)
            if shown:
                told += 1
    return errors[:told]
