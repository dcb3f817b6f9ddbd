"""Depth of one frame, moved into another by a motion, against the depth there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsm_data.geometry.camera import project, unproject
from wsm_data.geometry.transform import transform_points
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
    points = unproject(depth_m[a].astype(np.float64), intrinsics)[::stride, ::stride].reshape(-1, 3)
    return DepthPair(a=a, b=b, points_a_m=points[points[:, 2] > 0], depth_b_m=depth_m[b])


def relative_errors(pair: DepthPair, T_b_a: Float64Array, intrinsics: Intrinsics) -> Float64Array:
    """Predicted depth / depth there - 1 of every point under a motion; float64 [N].

    Not a number where frame b does not see the point, has no measurement there, or sees an edge.
    """
    pixels, z_m = project(transform_points(T_b_a, pair.points_a_m), intrinsics)
    corner = np.floor(pixels)
    height, width = pair.depth_b_m.shape
    inside = (z_m > 0) & (corner >= 0).all(axis=1) & (corner[:, 0] < width - 1) & (corner[:, 1] < height - 1)
    seen = np.flatnonzero(inside)
    column, row = corner[seen].astype(np.int64).T
    around_m = np.stack([pair.depth_b_m[row + dy, column + dx] for dy in (0, 1) for dx in (0, 1)], axis=1)
    smooth = (around_m > 0).all(axis=1) & (around_m.max(axis=1) <= MAX_EDGE_RATIO * around_m.min(axis=1))
    seen, around_m = seen[smooth], around_m[smooth].astype(np.float64)
    errors = np.full(len(z_m), np.nan)
    errors[seen] = z_m[seen] * _inverse_depth(around_m, (pixels - corner)[seen]) - 1
    return errors


def _inverse_depth(around_m: Float64Array, fraction: Float64Array) -> Float64Array:
    """Inverse depth between four pixels [N, 4], bilinear: exact on planes, where 1 / z is linear in the image."""
    x, y = fraction[:, 0], fraction[:, 1]
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    return (weights / around_m).sum(axis=1)
