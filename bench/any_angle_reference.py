"""Exact shortest paths on a grid, the slow way: every pair of cell centres that see each other is an edge.

The line of sight is the strict supercover: two centres see each other if the segment between them touches no blocked
square, not even at a corner. Here it is decided in whole numbers, so there is no rounding and nothing to tune.
"""

import math

import numpy as np
from numba import njit


def shortest_paths(traversable: np.ndarray, column: int, row: int) -> np.ndarray:
    """Lengths of the shortest paths from one cell to all others, in cells; float64 [Y, X], infinite where none is."""
    return _dijkstra(np.pad(~traversable, 1, constant_values=True), column + 1, row + 1)[1:-1, 1:-1]


@njit(cache=True)
def _dijkstra(blocked, column, row):
    """Dijkstra's algorithm over the whole graph; `blocked` has a border that is blocked."""
    rows, columns = np.nonzero(~blocked)
    distance = np.full(len(rows), np.inf)
    is_open = np.ones(len(rows), np.bool_)
    distance[(rows == row) & (columns == column)] = 0.0
    result = np.full(blocked.shape, np.inf)
    while True:
        here = -1
        for i in range(len(rows)):
            if is_open[i] and distance[i] < np.inf and (here < 0 or distance[i] < distance[here]):
                here = i
        if here < 0:
            return result
        is_open[here] = False
        result[rows[here], columns[here]] = distance[here]
        for i in range(len(rows)):
            if not is_open[i]:
                continue
            way = distance[here] + math.sqrt((rows[i] - rows[here]) ** 2 + (columns[i] - columns[here]) ** 2)
            if way < distance[i] - 1e-9 and sees(blocked, columns[here], rows[here], columns[i], rows[i]):
                distance[i] = way


@njit(cache=True)
def sees(blocked, x0, y0, x1, y1):
    """Whether the closed segment between two cell centres touches no closed blocked square.

    Coordinates are doubled, so that centres (odd) and borders of cells (even) are whole numbers, and heights over the
    columns are multiplied by the width dx of the segment.
    """
    if x0 > x1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    ax, ay, dx, dy = 2 * x0 + 1, 2 * y0 + 1, 2 * (x1 - x0), 2 * (y1 - y0)
    if dx == 0:
        return not blocked[min(y0, y1) : max(y0, y1) + 1, x0].any()
    for x in range(x0, x1 + 1):
        enter = ay * dx + (max(2 * x, ax) - ax) * dy
        leave = ay * dx + (min(2 * x + 2, ax + dx) - ax) * dy
        low, high = min(enter, leave), max(enter, leave)
        for y in range(-(-low // (2 * dx)) - 1, high // (2 * dx) + 1):
            if blocked[y, x]:
                return False
    return True
