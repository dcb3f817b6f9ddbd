"""The points of a path that the controller of the start-goal benchmark steers for."""

import numpy as np

from wsm_data.schema.arrays import Float64Array

REFERENCES = 6
"""How many points are made; the cost uses the first five."""

SPACING_M = 0.15
_FINE = 50


def reference_points(path_xy_m: Float64Array, position_xy_m: Float64Array) -> Float64Array:
    """Points about 0.15 m apart along a path, from the one nearest to the robot on.

    The path of n points is resampled to 50 n, evenly in the index (not in length). With c[i] the length of the first
    i + 1 resampled segments and k the nearest point, the points i = k .. 50 n - 2 are walked, and i is taken when
    c[i] - c[k] >= 0.15 m times the number taken so far. Where the path ends first, its last point is repeated.

    Args:
        path_xy_m: float64 [n, 2], n >= 2, m.
        position_xy_m: the robot in the same frame, m; [2].

    Returns:
        float64 [6, 2], m.
    """
    count = len(path_xy_m)
    index = np.linspace(0.0, count - 1.0, _FINE * count)
    fine = np.column_stack([np.interp(index, np.arange(count), path_xy_m[:, axis]) for axis in range(2)])
    length = np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))
    nearest = int(np.argmin(np.linalg.norm(fine - position_xy_m, axis=1)))
    points = np.tile(np.asarray(path_xy_m[-1], np.float64), (REFERENCES, 1))
    if nearest == len(length):  # the very last point has no segment of its own
        return points
    ahead = length[nearest:] - length[nearest]
    at = nearest
    for taken in range(REFERENCES):
        at = max(at, nearest + int(np.searchsorted(ahead, SPACING_M * taken)))
        if at >= len(length):
            break
        points[taken] = fine[at]
        at += 1
    return points
