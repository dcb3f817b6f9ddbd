"""The part of a map that an episode needs, and what its own driving proves about the floor."""

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.occupancy import FREE, UNKNOWN, OccupancyGrid


def crop_around(grid: OccupancyGrid, points_xy_m: Float64Array, margin_m: float) -> OccupancyGrid:
    """The smallest whole-cell rectangle around points and their margin; UNKNOWN where the map does not reach.

    Args:
        grid: the map.
        points_xy_m: positions that must be inside, m; [N, 2], N >= 1.
        margin_m: how far the rectangle reaches beyond them on every side, m.
    """
    points = grid.fractional_cells(np.asarray(points_xy_m, np.float64)) + 0.5
    margin = margin_m / grid.resolution_m
    low = np.floor(points.min(axis=0) - margin).astype(np.int64)
    high = np.floor(points.max(axis=0) + margin).astype(np.int64) + 1
    cells = np.full((high[1] - low[1], high[0] - low[0]), UNKNOWN, np.uint8)
    rows, columns = grid.cells.shape
    y0, y1 = np.clip([low[1], high[1]], 0, rows)
    x0, x1 = np.clip([low[0], high[0]], 0, columns)
    if y0 < y1 and x0 < x1:
        cells[y0 - low[1] : y1 - low[1], x0 - low[0] : x1 - low[0]] = grid.cells[y0:y1, x0:x1]
    origin = (grid.origin_cell[0] + int(low[0]), grid.origin_cell[1] + int(low[1]))
    return OccupancyGrid(cells=cells, origin_cell=origin, resolution_m=grid.resolution_m)


def free_swept_cells(grid: OccupancyGrid, path_xy_m: Float64Array, radius_m: float) -> tuple[OccupancyGrid, int]:
    """Take unknown cells that the expert's own footprint swept for free, and say how many those are.

    The robot stood there, which is evidence: in maps from depth the floor below the camera is never seen. A cell is
    swept if its centre is within the radius of the path, taken as straight between positions. Occupied cells stay.

    Args:
        grid: the map.
        path_xy_m: positions of the expert in the world, m; [T, 2].
        radius_m: radius of its footprint, m.
    """
    cells = np.array(grid.cells)
    path = np.ascontiguousarray(grid.fractional_cells(np.asarray(path_xy_m, np.float64)))
    freed = _free_along(cells, path, radius_m / grid.resolution_m)
    return OccupancyGrid(cells=cells, origin_cell=grid.origin_cell, resolution_m=grid.resolution_m), freed


@njit(cache=True)  # type: ignore[untyped-decorator]
def _free_along(cells: Uint8Array, path: Float64Array, radius: float) -> int:
    """Free the unknown cells whose centre (a whole number) is within `radius` of a path, in cells; in place."""
    freed = 0
    for i in range(len(path)):
        j = min(i + 1, len(path) - 1)
        ax, ay, bx, by = path[i, 0], path[i, 1], path[j, 0], path[j, 1]
        squared = (bx - ax) ** 2 + (by - ay) ** 2
        for row in range(max(0, int(min(ay, by) - radius)), min(cells.shape[0], int(max(ay, by) + radius) + 2)):
            for column in range(max(0, int(min(ax, bx) - radius)), min(cells.shape[1], int(max(ax, bx) + radius) + 2)):
                if cells[row, column] != UNKNOWN:
                    continue
                along = ((column - ax) * (bx - ax) + (row - ay) * (by - ay)) / squared if squared > 0 else 0.0
                along = min(max(along, 0.0), 1.0)
                dx, dy = column - ax - along * (bx - ax), row - ay - along * (by - ay)
                if dx * dx + dy * dy <= radius * radius:
                    cells[row, column] = FREE
                    freed += 1
    return freed
