"""Depth of one frame, moved into another by a motion, against the depth there."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit

from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.camera import Intrinsics

MAX_EDGE_RATIO = 1.1
"""Points at depth edges do not count: those where the four pixels around differ by more than this ratio."""


@dataclass(frozen=True, kw_only=True)
class DepthPair:
    """Two frames that are compared.

    Attributes:
        a: number of the frame whose points are moved.
        b: number of the frame they are held against.
        points_a_m: points of frame a in its camera, m; float64 [N, 3].
        depth_b_m: depth image of frame b, m, 0 without measurement; float32 [H, W].
    """

    a: int
    b: int
    points_a_m: Float64Array
    depth_b_m: Float32Array


def depth_pair(
    a: int, b: int, depth_m: Mapping[int, Float32Array], intrinsics: Intrinsics, max_points: int
) -> DepthPair:
    """Two frames of `depth_m`, of the first at most `max_points` pixels, on a square lattice."""
    stride = int(np.ceil(np.sqrt(depth_m[a].size / max_points)))
    rays = lattice_rays(intrinsics, stride)
    points = rays * depth_m[a][::stride, ::stride, None].astype(np.float64)
    return DepthPair(a=a, b=b, points_a_m=points[points[..., 2] > 0], depth_b_m=depth_m[b])


@lru_cache(maxsize=4)
def lattice_rays(intrinsics: Intrinsics, stride: int) -> Float64Array:
    """`pixel_rays` of every n-th row and column; not to be written to."""
    return np.ascontiguousarray(pixel_rays(intrinsics)[::stride, ::stride])


def relative_errors(pair: DepthPair, T_b_a: Float64Array, intrinsics: Intrinsics) -> Float64Array:
    """Predicted depth / depth there - 1 of every point: float64 [N] under a motion, [M, N] under motions [M, 4, 4].

    Not a number where frame b does not see the point, has no measurement there, or sees an edge.
    """
    K = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
    motions = np.ascontiguousarray(T_b_a.reshape(-1, 4, 4))
    errors: Float64Array = _warp_errors(pair.points_a_m, pair.depth_b_m, motions, K)
    return errors.reshape(*T_b_a.shape[:-2], -1)


@njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _warp_errors(
    points_a_m: Float64Array, depth_b_m: Float32Array, motions: Float64Array, K: Float64Array
) -> Float64Array:
    """`relative_errors` of motions, point by point; K is (fx, fy, cx, cy)."""
    height, width = depth_b_m.shape
    errors = np.full((len(motions), len(points_a_m)), np.nan)
    for m in range(len(motions)):
        T = motions[m]
        for i in range(len(points_a_m)):
            x, y, z = points_a_m[i, 0], points_a_m[i, 1], points_a_m[i, 2]
            ahead_m = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
            if not ahead_m > 0:  # nor where it is no number
                continue
            u = K[0] * (T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]) / ahead_m + K[2]
            v = K[1] * (T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]) / ahead_m + K[3]
            if not (u >= 0 and v >= 0 and u < width - 1 and v < height - 1):
                continue
            column, row = int(u), int(v)
            one, two = float(depth_b_m[row, column]), float(depth_b_m[row, column + 1])
            three, four = float(depth_b_m[row + 1, column]), float(depth_b_m[row + 1, column + 1])
            nearest, farthest = min(one, two, three, four), max(one, two, three, four)
            if nearest > 0 and farthest <= MAX_EDGE_RATIO * nearest:
                # 1 / z is linear in the image of a plane, so that it is 1 / z that is interpolated
                x, y = u - column, v - row
                upper, lower = (1 - x) / one + x / two, (1 - x) / three + x / four
                errors[m, i] = ahead_m * ((1 - y) * upper + y * lower) - 1
    return errors
