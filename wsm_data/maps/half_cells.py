"""Maps on a lattice of half cells, on which distances to occupied squares are exact.

Node (row, column) of the lattice stands at (column / 2, row / 2) in cells, where cell (row, column) is the square
[column, column + 1] x [row, row + 1]: corners, edges and centres of cells alike. The point of a square that is nearest
to a node is a node itself, so a distance transform of the nodes gives the distance to the squares without rounding.
"""

import numpy as np
from numba import njit

from wsm_data.schema.arrays import BoolArray, Float64Array, Uint8Array
from wsm_data.schema.occupancy import OCCUPIED

_FAR = 1e12
"""Stands for infinity in squared distances: sums and differences of it stay numbers."""


def half_cell_clearance(cells: Uint8Array) -> Float64Array:
    """Distance of every node to the nearest OCCUPIED square, in cells; infinite where there is none.

    The two passes of Felzenszwalb and Huttenlocher ("Distance Transforms of Sampled Functions", Theory of Computing 8,
    2012): gaps along the rows, then the lower envelope of parabolas along the columns.

    Args:
        cells: a map; uint8 [Y, X].

    Returns:
        float64 [2 Y + 1, 2 X + 1].
    """
    squared = _squared_distances(np.ascontiguousarray(cells))
    return np.where(squared < _FAR, np.sqrt(squared) / 2, np.inf)


def nodes_near(path_cells: Float64Array, shape: tuple[int, int], radius_cells: float) -> BoolArray:
    """Nodes within a distance of a path.

    Args:
        path_cells: (x, y) positions in cells, straight between them; float64 [T, 2], T >= 1.
        shape: rows and columns of the map.
        radius_cells: the distance, in cells.

    Returns:
        bool [2 Y + 1, 2 X + 1].
    """
    near = np.zeros((2 * shape[0] + 1, 2 * shape[1] + 1), np.bool_)
    _mark_near(near, np.ascontiguousarray(2 * path_cells), 2 * radius_cells)
    return near


@njit(cache=True)  # type: ignore[untyped-decorator]
def _squared_distances(cells: Uint8Array) -> Float64Array:
    """Squared distance to the nearest node of an OCCUPIED square, in half cells."""
    gaps = _row_gaps(_nodes_of(cells))
    rows, columns = gaps.shape
    squared = np.empty(gaps.shape)
    vertex, border = np.empty(rows, np.int64), np.empty(rows + 1)
    for column in range(columns):
        last = -1
        for row in range(rows):
            height = gaps[row, column]
            if height >= _FAR:
                continue
            cut = -np.inf
            while last >= 0:
                other = vertex[last]
                cut = (height + row * row - gaps[other, column] - other * other) / (2.0 * (row - other))
                if cut > border[last]:
                    break
                last -= 1
            last += 1
            vertex[last], border[last] = row, cut if last > 0 else -np.inf
        place = 0
        for row in range(rows):
            if last < 0:
                squared[row, column] = _FAR
                continue
            while place < last and border[place + 1] < row:
                place += 1
            squared[row, column] = (row - vertex[place]) ** 2 + gaps[vertex[place], column]
    return squared


@njit(cache=True)  # type: ignore[untyped-decorator]
def _nodes_of(cells: Uint8Array) -> BoolArray:
    """Nodes that lie in an OCCUPIED square or on its rim."""
    rows, columns = cells.shape
    nodes = np.zeros((2 * rows + 1, 2 * columns + 1), np.bool_)
    for row in range(rows):
        for column in range(columns):
            if cells[row, column] == OCCUPIED:
                nodes[2 * row : 2 * row + 3, 2 * column : 2 * column + 3] = True
    return nodes


@njit(cache=True)  # type: ignore[untyped-decorator]
def _row_gaps(nodes: BoolArray) -> Float64Array:
    """Squared distance of every node to the nearest marked one of its own row."""
    rows, columns = nodes.shape
    gaps = np.empty(nodes.shape)
    for row in range(rows):
        last = -_FAR
        for column in range(columns):
            last = float(column) if nodes[row, column] else last
            gaps[row, column] = column - last
        last = _FAR
        for column in range(columns - 1, -1, -1):
            last = float(column) if nodes[row, column] else last
            gap = min(gaps[row, column], last - column)
            gaps[row, column] = min(gap * gap, _FAR)
    return gaps


@njit(cache=True)  # type: ignore[untyped-decorator]
def _mark_near(near: BoolArray, path: Float64Array, radius: float) -> None:
    """Mark the nodes within `radius` of a path; everything in half cells."""
    rows, columns = near.shape
    for i in range(max(1, len(path) - 1)):
        ax, ay = path[i]
        bx, by = path[min(i + 1, len(path) - 1)]
        squared = (bx - ax) ** 2 + (by - ay) ** 2
        for row in range(max(0, int(min(ay, by) - radius)), min(rows, int(max(ay, by) + radius) + 2)):
            for column in range(max(0, int(min(ax, bx) - radius)), min(columns, int(max(ax, bx) + radius) + 2)):
                along = ((column - ax) * (bx - ax) + (row - ay) * (by - ay)) / squared if squared > 0 else 0.0
                along = min(max(along, 0.0), 1.0)
                dx, dy = column - ax - along * (bx - ax), row - ay - along * (by - ay)
                if dx * dx + dy * dy <= radius * radius:
                    near[row, column] = True
