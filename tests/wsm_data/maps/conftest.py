"""Maps to test on, and a slow, obvious judge of shortest paths."""

import math

import numpy as np
import pytest

from wsm_data.schema.occupancy import OccupancyGrid


def _sees(opaque, a, b):
    """Whether the closed segment between two cell centres touches no closed opaque square; exact, in doubled integers.

    Separating axes of a segment and a square: the axes of the square (only squares in the bounding box of the segment
    are asked), and the normal of the segment (all four corners strictly on one side).
    """
    (ax, ay), (bx, by) = (2 * a[0] + 1, 2 * a[1] + 1), (2 * b[0] + 1, 2 * b[1] + 1)
    left, right, low, high = min(a[0], b[0]), max(a[0], b[0]), min(a[1], b[1]), max(a[1], b[1])
    rows, columns = np.nonzero(opaque[low : high + 1, left : right + 1])
    corners_x = 2 * (columns + left)[:, None] + np.array([0, 2, 0, 2])
    corners_y = 2 * (rows + low)[:, None] + np.array([0, 0, 2, 2])
    sides = np.sign((bx - ax) * (corners_y - ay) - (by - ay) * (corners_x - ax))
    return not bool((np.abs(sides.sum(axis=1)) < 4).any())


def _shortest_paths(traversable, goal):
    """Dijkstra over the graph in which all mutually visible cell centres are joined, in cells; float64 [Y, X]."""
    opaque = ~traversable
    distance = np.full(traversable.shape, np.inf)
    distance[goal[1], goal[0]] = 0.0
    open_cells = {(int(x), int(y)) for y, x in np.argwhere(traversable)}
    while open_cells:
        here = min(open_cells, key=lambda cell: (distance[cell[1], cell[0]], cell))
        known = distance[here[1], here[0]]
        if not math.isfinite(known):
            break
        open_cells.remove(here)
        for there in open_cells:
            length = known + math.hypot(there[0] - here[0], there[1] - here[1])
            if length < distance[there[1], there[0]] - 1e-12 and _sees(opaque, here, there):
                distance[there[1], there[0]] = length
    return distance


@pytest.fixture
def sees():
    return _sees


@pytest.fixture
def shortest_paths():
    return _shortest_paths


@pytest.fixture
def grid_of():
    """A map of a drawing: '#' occupied, '.' free, '?' unknown; the first line is the highest row."""

    def build(drawing, origin_cell=(0, 0), resolution_m=0.05):
        lines = [line.strip() for line in drawing.strip().splitlines()][::-1]
        cells = np.array([[{".": 0, "#": 1, "?": 255}[mark] for mark in line] for line in lines], np.uint8)
        return OccupancyGrid(cells=cells, origin_cell=origin_cell, resolution_m=resolution_m)

    return build


@pytest.fixture
def cluttered_room():
    """A walled room [size, size] with rectangles and discs in it; bool, True where a robot may be."""

    def build(seed, size=36, things=7):
        rng = np.random.default_rng(seed)
        free = np.zeros((size, size), np.bool_)
        free[1:-1, 1:-1] = True
        y, x = np.mgrid[:size, :size]
        for _ in range(things):
            row, column = rng.integers(2, size - 3, 2)
            height, width, radius = rng.uniform(1, 6, 3)
            if rng.random() < 0.5:
                free[(np.abs(y - row) < height) & (np.abs(x - column) < width)] = False
            else:
                free[(y - row) ** 2 + (x - column) ** 2 < radius**2] = False
        return free

    return build
