"""The robot as a disc: where its centre may be, how near it comes to what is occupied, whether a path is free."""

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


def footprint_is_free(grid: OccupancyGrid, path_xy_m: Float64Array, radius_m: float) -> bool:
    """`footprints_are_free` of one path [T, 2]."""
    return bool(footprints_are_free(grid, np.asarray(path_xy_m)[None], radius_m)[0])


def footprints_are_free(grid: OccupancyGrid, paths_xy_m: Float64Array, radius_m: float) -> BoolArray:
    """Whether a disc can be driven along paths without touching what is occupied or leaving what is known.

    The centre must be in FREE cells and its clearance at least the radius, at the positions and between them at
    steps of no more than half a cell (spec/model.md, section 8).

    Args:
        grid: the map.
        paths_xy_m: positions in the world, m; [G, T, 2]. One that is not finite is not free.
        radius_m: radius of the disc, m.

    Returns:
        bool [G].
    """
    positions = grid.fractional_cells(np.asarray(paths_xy_m, np.float64)) + 0.5
    cells = np.ascontiguousarray(grid.cells)
    return np.asarray(_ways_are_free(cells, np.ascontiguousarray(positions), grid.resolution_m, radius_m))


@njit(cache=True)  # type: ignore[untyped-decorator]
def _ways_are_free(cells: Uint8Array, positions: Float64Array, resolution_m: float, radius_m: float) -> BoolArray:
    """The disc at (x, y) of paths [G, T, 2], in cells from the map's lower corner, and between them."""
    free = np.ones(len(positions), np.bool_)
    for path in range(len(positions)):
        for number in range(positions.shape[1]):
            x, y = positions[path, number, 0], positions[path, number, 1]
            x0, y0 = positions[path, max(number - 1, 0), 0], positions[path, max(number - 1, 0), 1]
            way = math.sqrt((x - x0) ** 2 + (y - y0) ** 2)
            if not math.isfinite(way):
                free[path] = False
                break
            steps = max(1, math.ceil(2 * way))
            for step in range(1, steps + 1):
                share = step / steps
                if not _disc_is_free(cells, x0 + (x - x0) * share, y0 + (y - y0) * share, resolution_m, radius_m):
                    free[path] = False
                    break
            if not free[path]:
                break
    return free


@njit(cache=True)  # type: ignore[untyped-decorator]
def _disc_is_free(cells: Uint8Array, x: float, y: float, resolution_m: float, radius_m: float) -> bool:
    """Whether the centre is in a FREE cell, and no OCCUPIED square is nearer to it than the radius."""
    rows, columns = cells.shape
    column0, row0 = math.floor(x), math.floor(y)
    if not (0 <= column0 < columns and 0 <= row0 < rows) or cells[row0, column0] != FREE:
        return False
    reach = math.ceil(radius_m / resolution_m) + 1
    for row in range(max(0, row0 - reach), min(rows, row0 + reach + 1)):
        for column in range(max(0, column0 - reach), min(columns, column0 + reach + 1)):
            if cells[row, column] == OCCUPIED:
                dx = max(column - x, x - column - 1, 0.0)
                dy = max(row - y, y - row - 1, 0.0)
                if math.sqrt(dx * dx + dy * dy) * resolution_m < radius_m:
                    return False
    return True
