"""A mesh seen from above, between two heights: what a robot of that height runs into, to the edge of every triangle."""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import Float64Array

_BUCKET_M = 0.5


@dataclass(frozen=True, kw_only=True)
class Outlines:
    """Triangles on the floor plan (vertical walls are flat ones), in square buckets.

    Attributes:
        triangles_m: corners; float64 [K, 3, 2].
        first: where the triangles of each bucket begin in `members`; int64 [Y X + 1].
        members: triangles that touch each bucket; int64 [M].
        origin_m: lower corner of the first bucket.
        columns: buckets along x.
    """

    triangles_m: Float64Array
    first: NDArray[np.int64]
    members: NDArray[np.int64]
    origin_m: tuple[float, float]
    columns: int

    def clearance_m(self, xy_m: Float64Array, most_m: float) -> Float64Array:
        """Distance of positions [N, 2] to the nearest triangle, zero inside one, at most `most_m`; float64 [N], m."""
        buckets = (self.first, self.members, self.origin_m[0], self.origin_m[1], self.columns)
        return _nearest(self.triangles_m, *buckets, np.ascontiguousarray(xy_m, np.float64), most_m)


def mesh_outlines(triangles_m: Float64Array, low_m: float, high_m: float) -> Outlines:
    """Cut triangles [F, 3, 3] to low_m <= z <= high_m and lay them flat."""
    flat = _cut(np.ascontiguousarray(triangles_m, np.float64), low_m, high_m)
    if not len(flat):
        flat = np.full((1, 3, 2), 1e9)
    low, high = np.floor(flat.min(axis=1) / _BUCKET_M), np.floor(flat.max(axis=1) / _BUCKET_M)
    origin = low.min(axis=0)
    columns, rows = (int(n) for n in high.max(axis=0) - origin + 1)
    low, high = (low - origin).astype(np.int64), (high - origin).astype(np.int64)
    pairs = [
        (row * columns + column, k)
        for k, (a, b) in enumerate(zip(low.tolist(), high.tolist(), strict=True))
        for row in range(a[1], b[1] + 1)
        for column in range(a[0], b[0] + 1)
    ]
    bucket, member = np.array(sorted(pairs), np.int64).T
    return Outlines(
        triangles_m=flat,
        first=np.searchsorted(bucket, np.arange(rows * columns + 1)).astype(np.int64),
        members=np.ascontiguousarray(member),
        origin_m=(float(origin[0] * _BUCKET_M), float(origin[1] * _BUCKET_M)),
        columns=columns,
    )


@njit(cache=True)  # type: ignore[untyped-decorator]
def _cut(triangles: Float64Array, low: float, high: float) -> Float64Array:
    """Corners on the floor plan of what is left of each triangle between two heights; [K, 3, 2]."""
    flat = np.empty((3 * len(triangles), 3, 2))
    count = 0
    for triangle in triangles:
        polygon, corners = np.zeros((8, 3)), 3
        polygon[:3] = triangle
        corners = _clip(polygon, corners, low, 1.0)
        corners = _clip(polygon, corners, high, -1.0)
        for k in range(1, corners - 1):
            flat[count, 0], flat[count, 1] = polygon[0, :2], polygon[k, :2]
            flat[count, 2] = polygon[k + 1, :2]
            count += 1
    return flat[:count].copy()


@njit(cache=True)  # type: ignore[untyped-decorator]
def _clip(polygon: Float64Array, corners: int, height: float, sign: float) -> int:
    """Keep what of a polygon lies above a height (sign 1) or below it (-1), in place; how many corners remain."""
    given, kept = polygon.copy(), 0
    for i in range(corners):
        a, b = given[i], given[(i + 1) % corners]
        above_a, above_b = sign * (a[2] - height), sign * (b[2] - height)
        if above_a >= 0.0:
            polygon[kept] = a
            kept += 1
        if (above_a > 0.0 and above_b < 0.0) or (above_a < 0.0 and above_b > 0.0):
            polygon[kept] = a + (b - a) * (above_a / (above_a - above_b))
            kept += 1
    return kept


@njit(cache=True)  # type: ignore[untyped-decorator]
def _nearest(
    triangles: Float64Array,
    first: NDArray[np.int64],
    members: NDArray[np.int64],
    x0: float,
    y0: float,
    columns: int,
    positions: Float64Array,
    most: float,
) -> Float64Array:
    rows = (len(first) - 1) // columns
    nearest = np.full(len(positions), most)
    for i in range(len(positions)):
        x, y = positions[i]
        left, right = max(0, math.floor((x - most - x0) / _BUCKET_M)), math.floor((x + most - x0) / _BUCKET_M)
        below, above = max(0, math.floor((y - most - y0) / _BUCKET_M)), math.floor((y + most - y0) / _BUCKET_M)
        for row in range(below, min(rows - 1, above) + 1):
            for column in range(left, min(columns - 1, right) + 1):
                bucket = row * columns + column
                for m in range(first[bucket], first[bucket + 1]):
                    nearest[i] = min(nearest[i], _distance(triangles[members[m]], x, y))
    return nearest


@njit(cache=True)  # type: ignore[untyped-decorator]
def _distance(triangle: Float64Array, x: float, y: float) -> float:
    """Distance of a point to a triangle, which may be flat: a segment."""
    nearest, left, right = np.inf, 0, 0
    for k in range(3):
        ax, ay = triangle[k]
        dx, dy = triangle[(k + 1) % 3, 0] - ax, triangle[(k + 1) % 3, 1] - ay
        px, py = x - ax, y - ay
        side = dx * py - dy * px
        left += side > 1e-12
        right += side < -1e-12
        square = dx * dx + dy * dy
        share = min(max((px * dx + py * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
        nearest = min(nearest, math.hypot(px - share * dx, py - share * dy))
    return 0.0 if left == 3 or right == 3 else nearest
