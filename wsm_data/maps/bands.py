"""Distances of cells beside obstacles, where a footprint does not fit but experts drive now and then.

Such a cell takes the best rim cell that it sees within a reach, plus the straight way to it; the rim are the
traversable cells that touch one which is not. Nothing is propagated from there: a gap that is too narrow stays closed.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.maps.sight import segment_is_clear
from wsm_data.schema.arrays import BoolArray, Float64Array


@njit(cache=True)  # type: ignore[untyped-decorator]
def fill_bands(
    opaque: BoolArray, walls: BoolArray, distance: Float64Array, x: float, y: float, reach: float
) -> Float64Array:
    """Distances with those of the cells that are neither walls nor traversable added; float64 [Y, X].

    Args:
        opaque: cells that are not traversable; bool [Y, X].
        walls: cells through which nothing is seen; bool [Y, X].
        distance: float64 [Y, X] in cells, infinite where not traversable.
        x: the goal.
        y: the goal.
        reach: how far such a cell looks, in cells.
    """
    limit = int(reach)
    offsets = np.arange(-limit, limit + 1)
    straight = np.sqrt((offsets**2).reshape(-1, 1) + offsets**2.0)
    half_width = np.array([int(math.sqrt(reach * reach - offset * offset)) for offset in offsets])
    following = _next_in_rim(opaque, distance, limit)
    filled = distance.copy()
    for row in range(1, distance.shape[0] - 1):
        for column in range(1, distance.shape[1] - 1):
            if walls[row, column] or not opaque[row, column]:
                continue
            best, squared = np.inf, (column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2
            if squared <= reach * reach and segment_is_clear(walls, x, y, column + 0.5, row + 0.5):
                best = math.sqrt(squared)
            filled[row, column] = _best_in_sight(walls, distance, following, straight, half_width, row, column, best)
    return filled


@njit(cache=True)  # type: ignore[untyped-decorator]
def _next_in_rim(opaque: BoolArray, distance: Float64Array, limit: int) -> NDArray[np.int32]:
    """For each cell the column of the first rim cell with a distance in its row from it on, X if there is none.

    Returns:
        int32 [Y + 2 limit, X + 2 limit]: `limit` rows and columns more on every side spare all questions about borders.
    """
    rows, columns = opaque.shape
    following = np.full((rows + 2 * limit, columns + 2 * limit), columns, np.int32)
    for row in range(1, rows - 1):
        upcoming = columns
        for column in range(columns - 2, -limit - 1, -1):
            if column > 0 and distance[row, column] < np.inf and _touches(opaque, row, column):
                upcoming = column
            following[row + limit, column + limit] = upcoming
    return following


@njit(cache=True)  # type: ignore[untyped-decorator]
def _touches(opaque: BoolArray, row: int, column: int) -> bool:
    """Whether one of the eight neighbours of a cell is opaque."""
    beside = opaque[row, column - 1] or opaque[row, column + 1] or opaque[row - 1, column] or opaque[row + 1, column]
    below = opaque[row - 1, column - 1] or opaque[row - 1, column + 1]
    return bool(beside or below or opaque[row + 1, column - 1] or opaque[row + 1, column + 1])


@njit(cache=True, inline="always")  # type: ignore[untyped-decorator]
def _best_in_sight(
    walls: BoolArray,
    distance: Float64Array,
    following: NDArray[np.int32],
    straight: Float64Array,
    half_width: NDArray[np.int64],
    row: int,
    column: int,
    best: float,
) -> float:
    """Least distance + straight way over the rim cells around one that it sees, `best` if none is less.

    The least of all is looked at first: it is in sight of 99 cells in 100, and then no other needs a look.
    """
    limit = len(half_width) // 2
    last = distance.shape[1] - 1
    lowest, at_row, at_column = best, -1, -1
    for look in range(2):
        for i in range(2 * limit + 1):
            j = following[row + i, column + limit - half_width[i]]
            while j <= min(column + half_width[i], last):
                value = distance[row + i - limit, j] + straight[i, j - column + limit]
                if look == 0 and value < lowest:
                    lowest, at_row, at_column = value, row + i - limit, j
                elif look == 1 and value < best and _sees(walls, row, column, row + i - limit, j):
                    best = value
                j = following[row + i, j + limit + 1]
        if look == 0 and (at_row < 0 or _sees(walls, row, column, at_row, at_column)):
            return lowest
    return best


@njit(cache=True)  # type: ignore[untyped-decorator]
def _sees(walls: BoolArray, row: int, column: int, other_row: int, other_column: int) -> bool:
    """Whether the centres of two cells see each other."""
    return segment_is_clear(walls, column + 0.5, row + 0.5, other_column + 0.5, other_row + 0.5)
