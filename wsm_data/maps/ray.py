"""How far it is along a ray to the first occupied cell of a map."""

import math

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.occupancy import OCCUPIED, OccupancyGrid


def free_ahead_m(grid: OccupancyGrid, xy_m: Float64Array, heading_rad: Float64Array, most_m: float) -> Float64Array:
    """Distance along a ray to the first OCCUPIED cell it enters.

    The cells are walked one after the other (Amanatides and Woo, "A Fast Voxel Traversal Algorithm", 1987).

    Args:
        grid: the map; what lies outside it is not occupied.
        xy_m: where the rays start, world, m; [N, 2].
        heading_rad: where they go, from the world's x axis towards y; [N].
        most_m: the distance that is given where nothing is met up to there, m.

    Returns:
        float64 [N], m; zero for a start inside an occupied cell.
    """
    starts = grid.fractional_cells(xy_m) + 0.5
    directions = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    most = most_m / grid.resolution_m
    return _march(np.ascontiguousarray(grid.cells), starts, directions, most) * grid.resolution_m


@njit(cache=True)  # type: ignore[untyped-decorator]
def _march(cells: Uint8Array, starts: Float64Array, directions: Float64Array, most: float) -> Float64Array:
    """Everything in cells."""
    rows, columns = cells.shape
    found = np.full(len(starts), most)
    for i in range(len(starts)):
        x, y = starts[i]
        dx, dy = directions[i]
        column, row = math.floor(x), math.floor(y)
        step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        per_column = abs(1.0 / dx) if dx != 0.0 else np.inf
        per_row = abs(1.0 / dy) if dy != 0.0 else np.inf
        next_x = (column + (dx > 0) - x) / dx if dx != 0.0 else np.inf
        next_y = (row + (dy > 0) - y) / dy if dy != 0.0 else np.inf
        gone = 0.0
        while gone < most:
            if 0 <= row < rows and 0 <= column < columns and cells[row, column] == OCCUPIED:
                found[i] = gone
                break
            if next_x < next_y:
                gone, column, next_x = next_x, column + step_x, next_x + per_column
            else:
                gone, row, next_y = next_y, row + step_y, next_y + per_row
    return found
