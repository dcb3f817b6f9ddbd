"""A path as a fixed number of points: what near-duplicates are told by, without reading a shard."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import Float32Array, Float64Array, require_array

PATH_POINTS = 32
"""Points of a path's outline."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Outlines:
    """Paths of some clips, and the floors they run on.

    Attributes:
        xy_m: points evenly spaced along each path, first and last included, world, m; float32 [M, P, 2].
        floor_z_m: height of the floor below each start, world z, m; float32 [M].
    """

    xy_m: Float32Array
    floor_z_m: Float32Array

    def __post_init__(self) -> None:
        require_array("xy_m", self.xy_m, np.float32, (None, None, 2))
        require_array("floor_z_m", self.floor_z_m, np.float32, (len(self.xy_m),))

    def take(self, numbers: NDArray[np.int64]) -> "Outlines":
        """Those of some of the clips, in the order of their numbers; int64 [n]."""
        return Outlines(xy_m=self.xy_m[numbers], floor_z_m=self.floor_z_m[numbers])


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
