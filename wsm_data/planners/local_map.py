"""A map that grows from depth scans."""

import math

import numpy as np
from numba import njit

from wsm_data.geometry.planar import points_from_base
from wsm_data.planners.depth_scan import DepthScan
from wsm_data.schema.arrays import Float64Array, Int16Array
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

_RESOLUTION_M = 0.05
_HALF_CELLS = 400
_HIT, _MISS, _MOST = 6, 1, 30
_MARGIN_M = 1.5


class LocalMap:
    """Evidence for and against obstacles in cells of 0.05 m, 20 m to every side of the start frame's origin.

    Args:
        radius_m: what the robot covers where it starts is free, m.
    """

    def __init__(self, radius_m: float) -> None:
        self._evidence = np.zeros((2 * _HALF_CELLS, 2 * _HALF_CELLS), np.int16)
        reach = math.ceil(radius_m / _RESOLUTION_M)
        middle = slice(_HALF_CELLS - reach, _HALF_CELLS + reach)
        self._evidence[middle, middle] = -_MISS
        self._low = np.full(2, _HALF_CELLS - reach)
        self._high = np.full(2, _HALF_CELLS + reach)

    def add(self, scan: DepthScan, pose: Float64Array) -> None:
        """Enter a scan that was taken at a pose of the start frame."""
        free = self._cells(points_from_base(scan.ray_ends_xy_m, pose))
        hits = self._cells(points_from_base(scan.obstacles_xy_m, pose))
        own = self._cells(pose[None, :2])
        _enter(self._evidence, own[0], free, hits)
        seen = np.concatenate([free, hits, own])
        self._low = np.clip(np.minimum(self._low, np.floor(seen.min(axis=0))), 0, 2 * _HALF_CELLS - 1).astype(int)
        self._high = np.clip(np.maximum(self._high, np.ceil(seen.max(axis=0))), 1, 2 * _HALF_CELLS).astype(int)

    def grid(self, also_xy_m: Float64Array) -> OccupancyGrid:
        """What is known so far, around it 1.5 m of the unknown, and the points `also_xy_m` [N, 2] inside."""
        also = self._cells(also_xy_m)
        margin = round(_MARGIN_M / _RESOLUTION_M)
        low = np.clip(np.minimum(self._low, np.floor(also.min(axis=0))) - margin, 0, 2 * _HALF_CELLS - 1).astype(int)
        high = np.clip(np.maximum(self._high, np.ceil(also.max(axis=0))) + margin, 1, 2 * _HALF_CELLS).astype(int)
        part = self._evidence[low[1] : high[1], low[0] : high[0]]
        cells = np.where(part > 0, OCCUPIED, np.where(part < 0, FREE, UNKNOWN)).astype(np.uint8)
        origin = (int(low[0]) - _HALF_CELLS, int(low[1]) - _HALF_CELLS)
        return OccupancyGrid(cells=cells, origin_cell=origin, resolution_m=_RESOLUTION_M)

    def _cells(self, xy_m: Float64Array) -> Float64Array:
        """Positions as (column, row), where whole numbers are the cells' lower corners."""
        return np.asarray(xy_m / _RESOLUTION_M + _HALF_CELLS)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _enter(evidence: Int16Array, own: Float64Array, free: Float64Array, hits: Float64Array) -> None:
    """Lower the evidence along each ray up to a cell before its end, raise it where it was hit; once in each cell."""
    rows, columns = evidence.shape
    passed = np.zeros(evidence.shape, np.bool_)
    for ray in range(len(free)):
        dx, dy = free[ray, 0] - own[0], free[ray, 1] - own[1]
        length = math.sqrt(dx * dx + dy * dy)
        for k in range(int(2 * (length - 1.0))):
            share = 0.5 * k / length
            column, row = int(own[0] + share * dx), int(own[1] + share * dy)
            if 0 <= row < rows and 0 <= column < columns and not passed[row, column]:
                passed[row, column] = True
                evidence[row, column] = max(evidence[row, column] - _MISS, -_MOST)
    raised = np.zeros(evidence.shape, np.bool_)
    for i in range(len(hits)):
        column, row = int(hits[i, 0]), int(hits[i, 1])
        if 0 <= row < rows and 0 <= column < columns and not raised[row, column]:
            raised[row, column] = True
            evidence[row, column] = min(max(evidence[row, column], 0) + _HIT, _MOST)
