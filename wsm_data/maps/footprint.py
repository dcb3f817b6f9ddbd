"""The robot as a disc: where its centre may be, how near it comes to what is occupied, whether a path is free."""

import math
from itertools import pairwise

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


def footprint_is_free(grid: OccupancyGrid, path_xy_m: Float64Array, radius_m: float) -> bool:
    """Whether a disc can be driven along a path without touching what is occupied or leaving what is known.

    The centre must be in FREE cells and its clearance at least the radius, at the positions and between them at
    steps of no more than half a cell (spec/model.md, section 8).

    Args:
        grid: the map.
        path_xy_m: positions in the world, m; [T, 2].
        radius_m: radius of the disc, m.
    """
    dense = _densify(path_xy_m, grid.resolution_m / 2)
    columns, rows = np.floor(grid.fractional_cells(dense) + 0.5).astype(np.int64).T
    inside = (columns >= 0) & (columns < grid.cells.shape[1]) & (rows >= 0) & (rows < grid.cells.shape[0])
    if not inside.all() or (grid.cells[rows, columns] != FREE).any():
        return False
    return bool((clearance_m(grid, dense) >= radius_m).all())


def _densify(path_xy_m: Float64Array, step_m: float) -> Float64Array:
    """The positions of a path [T, 2] and evenly spaced ones between them, no more than `step_m` apart; [N, 2]."""
    path = np.asarray(path_xy_m, np.float64)
    parts = [path[:1]]
    for start, end in pairwise(path):
        steps = max(1, math.ceil(float(np.linalg.norm(end - start)) / step_m))
        parts.append(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
    return np.concatenate(parts)
