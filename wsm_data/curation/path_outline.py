"""A path as a fixed number of points: what near-duplicates are told by, without reading a shard."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def path_outline(path_xy_m: Float64Array, points: int) -> Float64Array:
    """Points evenly spaced in arc length along a polyline; the first and the last are those of the path, exactly.

    Args:
        path_xy_m: positions in order, m; [T, 2], T >= 1. A path without length gives its position again and again.
        points: how many, at least 2.

    Returns:
        float64 [points, 2], m.
    """
    steps = np.linalg.norm(np.diff(path_xy_m, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    kept = np.concatenate([[True], steps > 0])  # interpolation needs arc lengths that rise
    wanted = np.linspace(0.0, arc[-1], points)
    outline = np.column_stack([np.interp(wanted, arc[kept], path_xy_m[kept, axis]) for axis in range(2)])
    outline[0], outline[-1] = path_xy_m[0], path_xy_m[-1]
    return outline
