"""Which points lie within a voxel of a map's surface."""

import numpy as np
from numba import njit

from wsm_data.maps.scene_map import FloorLevel
from wsm_data.schema.arrays import BoolArray, Float64Array, Int16Array
from wsm_data.schema.surface import CELL_SIZE_M, LAYER_HEIGHT_M


def near_surface(level: FloorLevel, points_m: Float64Array, reach_m: float = CELL_SIZE_M) -> BoolArray:
    """Whether a box of the level comes within `reach_m` of a point along each of the three axes; bool [N].

    Args:
        level: the surface.
        points_m: points in the world, m; float64 [N, 3].
        reach_m: how far a box may lie from a point, along each axis, m.
    """
    points = np.ascontiguousarray(points_m, np.float64)
    return _near(level.first, level.layers, level.origin_cell, level.shape, points, reach_m)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _near(
    first: np.ndarray,
    layers: Int16Array,
    origin_cell: tuple[int, int],
    shape: tuple[int, int],
    points_m: Float64Array,
    reach_m: float,
) -> BoolArray:
    near = np.zeros(len(points_m), np.bool_)
    for i in range(len(points_m)):
        x, y, z = points_m[i, 0], points_m[i, 1], points_m[i, 2]
        lowest = np.floor((z - reach_m) / LAYER_HEIGHT_M)
        highest = np.floor((z + reach_m) / LAYER_HEIGHT_M)
        column0 = max(int(np.floor((x - reach_m) / CELL_SIZE_M)) - origin_cell[0], 0)
        column1 = min(int(np.floor((x + reach_m) / CELL_SIZE_M)) - origin_cell[0], shape[1] - 1)
        row0 = max(int(np.floor((y - reach_m) / CELL_SIZE_M)) - origin_cell[1], 0)
        row1 = min(int(np.floor((y + reach_m) / CELL_SIZE_M)) - origin_cell[1], shape[0] - 1)
        for row in range(row0, row1 + 1):
            for column in range(column0, column1 + 1):
                if near[i]:
                    break
                cell = row * shape[1] + column
                for box in range(first[cell], first[cell + 1]):
                    if lowest <= layers[box] <= highest:
                        near[i] = True
    return near
