"""Small holes in what was seen of the floor: sparse clouds leave unknown cells that act as walls."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


def fill_holes(grid: OccupancyGrid, max_cells: int) -> tuple[OccupancyGrid, int]:
    """Take unknown cells that lie in between free ones for free, and say how many those are.

    A cell is filled if along both axes it lies in a gap of at most `max_cells` unknown cells between two FREE ones, and
    no cell of the square that reaches `max_cells` from it to every side is OCCUPIED. So nothing turns free beside an
    obstacle or at the edge of what was seen. All cells are judged on the map as it was: what is filled does not help to
    fill more.

    Args:
        grid: the map.
        max_cells: longest gap that is filled, in cells; 0 fills nothing.

    Raises:
        ValueError: `max_cells` is negative.
    """
    if max_cells < 0:
        raise ValueError(f"max_cells must not be negative, found {max_cells}")
    filled = (grid.cells == UNKNOWN) & ~_near_obstacle(grid, max_cells)
    for axis in (0, 1):
        before, after = (_to_free(grid, max_cells, axis, step) for step in (-1, 1))
        filled &= before + after - 1 <= max_cells
    cells = np.where(filled, np.uint8(FREE), grid.cells)
    filled_grid = OccupancyGrid(cells=cells, origin_cell=grid.origin_cell, resolution_m=grid.resolution_m)
    return filled_grid, int(np.count_nonzero(filled))


def _near_obstacle(grid: OccupancyGrid, max_cells: int) -> BoolArray:
    """Cells with an OCCUPIED one in the square that reaches `max_cells` to every side; bool [Y, X]."""
    near: BoolArray = np.pad(grid.cells == OCCUPIED, max_cells)
    for axis in (0, 1):
        near = np.asarray(sliding_window_view(near, 2 * max_cells + 1, axis=axis).any(axis=-1))
    return near


def _to_free(grid: OccupancyGrid, max_cells: int, axis: int, step: int) -> NDArray[np.int64]:
    """Cells to the next FREE one in a direction, more than 2 max_cells where none is that near; int64 [Y, X].

    An OCCUPIED one before it cannot hide it: cells with such a one near are ruled out.
    """
    free = np.pad(grid.cells == FREE, max_cells)
    found = np.full(grid.cells.shape, 2 * max_cells + 1, np.int64)
    rows, columns = grid.cells.shape
    for distance in range(max_cells, 0, -1):
        row, column = (max_cells + (step * distance if axis == each else 0) for each in (0, 1))
        found[free[row : row + rows, column : column + columns]] = distance
    return found
