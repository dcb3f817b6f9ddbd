"""The surface of a scene as a set of small boxes: what is kept of a point cloud or of fused depth."""

from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import BoolArray, Int16Array, frozen_array, require_array

CELL_SIZE_M = 0.05
"""Side of a map cell over the floor, m: the resolution at which InternData-N1's expert planned."""

LAYER_HEIGHT_M = 0.01
"""Height of a box, m: fine enough that the robot's height band is cut to a centimetre."""


@dataclass(frozen=True, kw_only=True)
class SurfaceVoxels:
    """Occupied boxes of a scene on the world's own grid, sorted, each once.

    Box (ix, iy, iz) covers [ix c, (ix + 1) c) x [iy c, (iy + 1) c) x [iz l, (iz + 1) l) in world coordinates, with
    c = CELL_SIZE_M and l = LAYER_HEIGHT_M. Anchored at the world's origin, equal points give equal boxes wherever
    they were read from.

    Attributes:
        cells: (ix, iy, iz); int16 [N, 3], in lexicographic order.
        obstacle: whether the source marks the box as an obstacle; bool [N].
        origin: `cloud`, `depth` where there was no cloud and depth images were fused, or `path` where there was neither
            and so no box.
    """

    cells: Int16Array
    obstacle: BoolArray
    origin: str

    def __post_init__(self) -> None:
        require_array("cells", self.cells, np.int16, (None, 3))
        require_array("obstacle", self.obstacle, np.bool_, (len(self.cells),))
        if self.origin not in ("cloud", "depth", "path"):
            raise ValueError(f"origin must be 'cloud', 'depth' or 'path', found {self.origin!r}")
        if self.origin == "path" and len(self.cells):
            raise ValueError(f"a scene of which only paths are known must have no box, found {len(self.cells)}")
        _require_strict_order(self.cells)
        object.__setattr__(self, "cells", frozen_array(self.cells))
        object.__setattr__(self, "obstacle", frozen_array(self.obstacle))


def _require_strict_order(cells: Int16Array) -> None:
    x, y, z = cells.T.astype(np.int64)
    rank = (x << 32) + (y << 16) + z  # int16 coordinates: one number whose order is the lexicographic one
    steps = np.diff(rank)
    if (steps <= 0).any():
        row = int((steps <= 0).argmax())
        raise ValueError(
            f"cells must be sorted and unique, found {cells[row].tolist()} before {cells[row + 1].tolist()}"
        )
