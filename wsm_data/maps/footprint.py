"""The robot as a disc: where its centre may be, and how near it comes to what is occupied."""

import math

import numpy as np
from numba import njit

from wsm_data.schema.arrays import BoolArray, Float64Array, Uint8Array
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid


def traversable(grid: OccupancyGrid, radius_m: float) -> BoolArray:
    """FREE cells whose centre is at least `radius_m` from the centre of every OCCUPIED cell; bool [Y, X].

    Centres, not edges, are compared: the surface inside an occupied cell lies anywhere in it, on average at its
    centre, and so the expert's own planner inflates its map. Unknown cells are not traversable, and do not keep
    the robot away from their neighbours either.
    """
    radius_cells = radius_m / grid.resolution_m
    return _outside_discs(np.ascontiguousarray(grid.cells), radius_cells**2 * (1 - 1e-12))


@njit(cache=True)  # type: ignore[untyped-decorator]
def _outside_discs(cells: Uint8Array, radius_squared: float) -> BoolArray:
    """FREE cells with no OCCUPIED one at a squared distance (in cells) below `radius_squared`."""
    rows, columns = cells.shape
    gap = _row_gaps(cells)
    free = cells == FREE
    for offset in range(-int(math.sqrt(radius_squared)), int(math.sqrt(radius_squared)) + 1):
        for row in range(max(0, -offset), min(rows, rows - offset)):
            for column in range(columns):
                step = gap[row + offset, column]
                if step * step + offset * offset < radius_squared:
                    free[row, column] = False
    return free


@njit(cache=True)  # type: ignore[untyped-decorator]
def _row_gaps(cells: Uint8Array) -> Float64Array:
    """Distance of every cell to the nearest OCCUPIED one of its own row, in cells; infinite where there is none."""
    rows, columns = cells.shape
    gap = np.full(cells.shape, np.inf)
    for row in range(rows):
        last = -np.inf
        for column in range(columns):
            last = column if cells[row, column] == OCCUPIED else last
            gap[row, column] = column - last
        last = np.inf
        for column in range(columns - 1, -1, -1):
            last = column if cells[row, column] == OCCUPIED else last
            gap[row, column] = min(gap[row, column], last - column)
    return gap


def clearance_m(grid: OccupancyGrid, xy_m: Float64Array) -> Float64Array:
    """Distance of positions to the nearest OCCUPIED cell, to its square and not its centre.

    Args:
        grid: the map; what lies outside it is not occupied.
        xy_m: positions in the world, m; [..., 2].

    Returns:
        float64 [...], m; zero inside an occupied cell, infinite where the map has none.
    """
    positions = grid.fractional_cells(np.asarray(xy_m, np.float64)) + 0.5
    flat = np.ascontiguousarray(positions.reshape(-1, 2))
    return _nearest_squares(np.ascontiguousarray(grid.cells), flat).reshape(positions.shape[:-1]) * grid.resolution_m


@njit(cache=True)  # type: ignore[untyped-decorator]
def _nearest_squares(cells: Uint8Array, positions: Float64Array) -> Float64Array:
    """Distance in cells from each (x, y) to the nearest OCCUPIED square: rings of cells, until none can be nearer."""
    rows, columns = cells.shape
    nearest = np.full(len(positions), np.inf)
    for index in range(len(positions)):
        x, y = positions[index, 0], positions[index, 1]
        # rings are counted around the map's cell that is nearest to the position
        column0 = min(max(math.floor(x), 0), columns - 1)
        row0 = min(max(math.floor(y), 0), rows - 1)
        best = np.inf
        for ring in range(max(rows, columns)):
            if ring - 1 > best:  # a cell of this ring is at least ring - 1 cells away
                break
            for row in range(max(0, row0 - ring), min(rows, row0 + ring + 1)):
                edge = row == row0 - ring or row == row0 + ring
                step = 1 if edge or ring == 0 else 2 * ring
                for column in range(column0 - ring, column0 + ring + 1, step):
                    if 0 <= column < columns and cells[row, column] == OCCUPIED:
                        dx = max(column - x, x - column - 1, 0.0)
                        dy = max(row - y, y - row - 1, 0.0)
                        best = min(best, math.sqrt(dx * dx + dy * dy))
        nearest[index] = best
    return nearest
