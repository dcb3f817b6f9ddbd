"""What can be seen of a grid from a point: cones of rays that are swept over the cells, and single segments.

Positions are continuous (x, y) in cells: cell (row, column) is the square [column, column + 1] x [row, row + 1] and
its centre is (column + 1/2, row + 1/2). The line-of-sight rule of the whole package is the strict supercover: two
points see each other if the segment between them touches no opaque square, not even at a corner. So nothing is seen
through the point where two opaque cells meet diagonally.
"""

import heapq
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float64Array

_EDGE = 1e-9
"""Widens an octant over its own border rays (slopes 0 and 1), and closes the ends of rows in `segment_is_clear`, cells.
Slopes that a map's corners and centres can form differ by 1 / cells^2, a million times as much."""

_SLACK_DECAY = 0.25
"""The slack halves in the first four rows; measured with _SLACK_CELLS of the field."""


@njit(cache=True)  # type: ignore[untyped-decorator]
def clip_slopes(lo: float, hi: float, offset: float, gradient: float) -> tuple[float, float]:
    """Cut the slopes [lo, hi] to where offset + slope * gradient <= 0; the cut is empty where lo >= hi."""
    if gradient > 0.0:
        return lo, min(hi, -offset / gradient)
    if gradient < 0.0:
        return max(lo, -offset / gradient), hi
    return (lo, hi) if offset < 0.0 else (0.0, 0.0)


@njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def sweep_octant(  # one loop over rows, cones and cells: the heart of the field's speed, not worth cutting up
    opaque: BoolArray,
    turns: BoolArray,
    distance: Float64Array,
    parent: NDArray[np.int32],
    queue: list[tuple[float, int]],
    cones: Float64Array,
    source: tuple[float, float, float],
    index: int,
    frame: tuple[int, int, int, float, float],
    slopes: tuple[float, float],
    slack: float,
) -> None:
    """Lower the distance of every cell centre that a source sees inside a cone of one octant.

    The sweep goes away from the source row by row. A cone (lo, hi) holds the slopes (side over forward) that are
    still open; an opaque cell takes the slopes between its two outer corners out of it. Rays along which centres are
    already reached by a path shorter by `slack` are dropped: by the triangle inequality the other path stays the
    shorter one all along the rest of the ray. The slack allows for the rays between the centres, which lie the closer
    the farther the sweep has come, so it falls with the distance from the source.

    Args:
        opaque: bool [cells], flat, with an opaque border all around, which ends every sweep.
        turns: bool [cells]; cells that are queued when their distance falls.
        distance: float64 [cells] in cells, lowered in place.
        parent: int32 [cells], the source that gave a queued cell its distance, written in place.
        queue: heap of (distance, cell), pushed to in place.
        cones: float64 [2, n, 2] workspace, n above the longer side of the map.
        source: its (x, y) and distance, in cells.
        index: what is written to `parent` for this source.
        frame: flat index of the octant's cell (0, 0), steps to the next cell sideways and forward, and the source's
            sideways and forward coordinate.
        slopes: the open cone, within [0, 1].
        slack: see above, at the source, in cells.
    """
    origin, step_side, step_forward, side0, forward0 = frame
    distance0 = source[2]
    cones[0, 0, 0] = slopes[0] if slopes[0] > 0.0 else -_EDGE
    cones[0, 0, 1] = slopes[1] if slopes[1] < 1.0 else 1.0 + _EDGE
    count, now = 1, 0
    row = math.floor(forward0)
    while count > 0:
        near, middle, far = row - forward0, row + 0.5 - forward0, row + 1 - forward0
        margin = slack / (1.0 + _SLACK_DECAY * max(middle, 0.0)) - distance0
        following, after, first = 0, 1 - now, origin + row * step_forward
        for i in range(count):
            lo, hi = cones[now, i, 0], cones[now, i, 1]
            keep_lo, keep_hi, seen, kept = lo, hi, False, False
            column = math.floor(side0 + lo * max(near, 0.0))
            last = math.floor(side0 + hi * far)
            while True:
                cell = np.uintp(first + column * step_side)
                ends = column > last
                if ends or opaque[cell]:
                    # the stretch of sight before this cell goes on, cut to the rays that can still improve something
                    top = hi if ends else min(hi, (column - side0) / far)
                    if kept:
                        keep_lo, top = max(lo, keep_lo), min(top, keep_hi)
                    if keep_lo < top and (kept or not seen):
                        cones[after, following, 0], cones[after, following, 1] = keep_lo, top
                        following += 1
                    if ends or near <= 0.0:
                        break
                    lo = max(lo, (column + 1 - side0) / near)
                    if lo >= hi:
                        break
                    keep_lo, keep_hi, seen, kept = lo, hi, False, False
                elif middle > 0.0:
                    side = column + 0.5 - side0
                    slope = side / middle
                    if lo < slope < hi:
                        seen = True
                        length = math.sqrt(side * side + middle * middle)
                        known = distance[cell]
                        if length < known + margin:
                            kept, keep_hi = True, hi
                            value = distance0 + length
                            if value < known:
                                distance[cell] = value
                                if turns[cell]:
                                    parent[cell] = index
                                    heapq.heappush(queue, (value, first + column * step_side))
                        elif not kept:
                            keep_lo = slope - _EDGE
                        elif keep_hi == hi:
                            keep_hi = slope + _EDGE
                column += 1
        now, count = after, following
        row += 1


@njit(cache=True)  # type: ignore[untyped-decorator]
def segment_is_clear(opaque: BoolArray, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether two points of a grid see each other; opaque is bool [Y, X] and both points lie inside it."""
    if x0 > x1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    gradient = (y1 - y0) / (x1 - x0) if x1 > x0 else 0.0
    for column in range(math.floor(x0 - _EDGE), math.floor(x1 + _EDGE) + 1):
        enter = y0 + (max(float(column), x0) - x0) * gradient
        leave = y0 + (min(column + 1.0, x1) - x0) * gradient if x1 > x0 else y1
        for row in range(math.floor(min(enter, leave) - _EDGE), math.floor(max(enter, leave) + _EDGE) + 1):
            if opaque[row, column]:
                return False
    return True
