"""Any-angle geodesic distance to the goal region over a grid of robot positions.

A path runs from cell centre to cell centre along straight lines of sight (strict supercover, `sight.py`): the shortest
one is what is stored, not a walk of eight-neighbour steps (4.8 % too long) and not a solution of the eikonal equation
(0.4 %). A taut path turns only where it bends around a convex corner of the blocked area, so Dijkstra's algorithm runs
over the cells near such corners alone. Each of them, when it is final, sweeps the wedge behind its corner, which its
predecessor could not see (`sight.sweep_octant`), and lowers all distances there in one pass.

Against the graph of all mutually visible cells bench/geodesic.py measures what the two settings below leave: no
distance comes out too short, and the mean error is a few parts in ten thousand at most.
"""

import heapq
import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.maps.bands import fill_bands
from wsm_data.maps.footprint import traversable as where_traversable
from wsm_data.maps.sight import clip_slopes, segment_is_clear, sweep_octant
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array, require_array
from wsm_data.schema.occupancy import FREE, OccupancyGrid

_TURN_CELLS = 2
"""Paths may turn in the cells this near to a corner. Centres lie on a lattice, so the best turn need not touch the
corner: 1 errs by up to 1.0 %, 2 by 0.4 %, 3 by 0.1 % at twice the time."""

_SLACK_CELLS = 0.3
"""See `sight.sweep_octant`; 0.05 errs by up to 1 %, from 0.3 on nothing changes but the time."""

_GOAL, _NO_PARENT = -1, -2
_REACH_PER_RADIUS = math.sqrt(2)
"""A free cell in a right-angled corner of walls is up to sqrt(2) radii away from the nearest traversable one."""


def geodesic_distance(
    grid: OccupancyGrid, goal_xy_m: Float64Array, robot_radius_m: float, goal_radius_m: float
) -> Float32Array:
    """Distance D(x) of a disc-shaped robot to the goal region, for every cell of a map.

    Only FREE cells have a distance: what is unknown is not driven through.

    Args:
        grid: the map.
        goal_xy_m: centre of the goal region in the world, m; [2].
        robot_radius_m: radius of the footprint, m.
        goal_radius_m: radius r_g of the goal region, m.

    Returns:
        float32 [Y, X], m; see `geodesic_field`.
    """
    column, row = grid.fractional_cells(np.asarray(goal_xy_m, np.float64))
    return geodesic_field(
        where_traversable(grid, robot_radius_m),
        grid.cells != FREE,
        (float(column), float(row)),
        grid.resolution_m,
        goal_radius_m,
        _REACH_PER_RADIUS * robot_radius_m,
    )


def geodesic_field(
    traversable: BoolArray,
    blocked: BoolArray,
    goal_column_row: tuple[float, float],
    resolution_m: float,
    goal_radius_m: float,
    reach_m: float,
) -> Float32Array:
    """Length of the shortest path through traversable cells to the goal region, for every cell.

    The goal region is the geodesic ball of radius r_g around the goal, so D = max(0, d - r_g) with d the distance to
    the goal itself. A cell that is neither traversable nor blocked (free, but nearer to an obstacle than the footprint
    allows) takes the best traversable one that it sees within `reach_m`, plus the straight way to it (`bands.py`). A
    goal in such a place is connected to all traversable cells that it sees within `reach_m`.

    Args:
        traversable: where the robot's centre may be; bool [Y, X].
        blocked: cells without a distance, through which nothing is seen (occupied and unknown); bool [Y, X].
        goal_column_row: the goal in fractional cells, where whole numbers are cell centres.
        resolution_m: side of a cell, m.
        goal_radius_m: radius r_g of the goal region, m.
        reach_m: how far a cell beside an obstacle looks for a traversable one, m.

    Returns:
        float32 [Y, X], m; infinite where blocked or unreachable. All infinite if the goal is blocked or off the map.

    Raises:
        ValueError: the arrays differ in shape, or a cell is both traversable and blocked.
    """
    require_array("traversable", traversable, np.bool_, (None, None))
    require_array("blocked", blocked, np.bool_, traversable.shape)
    if (traversable & blocked).any():
        raise ValueError(f"{int((traversable & blocked).sum())} cells are both traversable and blocked")
    rows, columns = traversable.shape
    x, y = goal_column_row[0] + 0.5, goal_column_row[1] + 0.5
    if not (0 <= x < columns and 0 <= y < rows) or blocked[int(y), int(x)]:
        return np.full(traversable.shape, np.inf, np.float32)
    opaque = np.pad(np.ascontiguousarray(~traversable), 1, constant_values=True)
    walls = np.pad(np.ascontiguousarray(blocked), 1, constant_values=True)
    distance = _solve(opaque, walls, x + 1, y + 1, reach_m / resolution_m)
    distance = fill_bands(opaque, walls, distance, x + 1, y + 1, reach_m / resolution_m)
    return np.maximum(distance[1:-1, 1:-1] * resolution_m - goal_radius_m, 0.0).astype(np.float32)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _find_turns(opaque: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Where a path can bend.

    Returns:
        convex: lower left corners of cells at which one of the four cells that meet there is opaque; bool [Y, X].
        turns: traversable cells within _TURN_CELLS of such a corner; bool [Y, X].
    """
    rows, columns = opaque.shape
    convex = np.zeros(opaque.shape, np.bool_)
    turns = np.zeros(opaque.shape, np.bool_)
    for row in range(1, rows):
        for column in range(1, columns):
            below = int(opaque[row - 1, column - 1]) + int(opaque[row - 1, column])
            convex[row, column] = below + int(opaque[row, column - 1]) + int(opaque[row, column]) == 1
            if convex[row, column]:
                for i in range(max(0, row - _TURN_CELLS), min(rows, row + _TURN_CELLS)):
                    for j in range(max(0, column - _TURN_CELLS), min(columns, column + _TURN_CELLS)):
                        turns[i, j] = not opaque[i, j]
    return convex, turns


@njit(cache=True)  # type: ignore[untyped-decorator]
def _bend(convex: BoolArray, row: int, column: int, dx: float, dy: float, side: float) -> tuple[float, float]:
    """The farthest direction into which a path that arrives in a cell along (dx, dy) can bend around a corner.

    Args:
        convex: see `_find_turns`.
        row: the cell.
        column: the cell.
        dx: direction of arrival.
        dy: direction of arrival.
        side: 1 for bends to the right (clockwise where x goes right and y up), -1 for bends to the left.

    Returns:
        The direction from the cell's centre to that corner, (0, 0) if there is none on this side.
    """
    ex, ey = 0.0, 0.0
    for i in range(max(0, row - _TURN_CELLS + 1), min(convex.shape[0], row + _TURN_CELLS + 1)):
        for j in range(max(0, column - _TURN_CELLS + 1), min(convex.shape[1], column + _TURN_CELLS + 1)):
            if convex[i, j]:
                wx, wy = j - column - 0.5, i - row - 0.5
                if side * (dx * wy - dy * wx) < 0.0 and (ex == 0.0 or side * (ex * wy - ey * wx) < 0.0):
                    ex, ey = wx, wy
    return ex, ey


@njit(cache=True)  # type: ignore[untyped-decorator]
def _sweep_wedge(
    shape: tuple[int, int],
    opaque: BoolArray,
    turns: BoolArray,
    distance: Float64Array,
    parent: NDArray[np.int32],
    queue: list[tuple[float, int]],
    cones: Float64Array,
    source: tuple[float, float, float],
    index: int,
    wedge: tuple[float, float, float, float, float],
) -> None:
    """Sweep the directions between (dx, dy) and (ex, ey) from a source: wedge is (side, dx, dy, ex, ey).

    Side 1 goes clockwise from (dx, dy), -1 the other way, over less than half a turn; side 0 is the full circle.
    Arrays are flat, as `sweep_octant` takes them.
    """
    side, dx, dy, ex, ey = wedge
    rows, columns = shape
    for octant in range(8):
        sign_x, sign_y, steep = 1 - 2 * (octant & 1), 1 - (octant & 2), octant >> 2
        fx, fy = (0.0, float(sign_y)) if steep else (float(sign_x), 0.0)
        sx, sy = (float(sign_x), 0.0) if steep else (0.0, float(sign_y))
        lo, hi = clip_slopes(0.0, 1.0, side * (dx * fy - dy * fx) - (side == 0.0), side * (dx * sy - dy * sx))
        lo, hi = clip_slopes(lo, hi, side * (fx * ey - fy * ex) - (side == 0.0), side * (sx * ey - sy * ex))
        if lo >= hi:
            continue
        x = source[0] if sign_x > 0 else columns - source[0]
        y = source[1] if sign_y > 0 else rows - source[1]
        origin = (0 if sign_x > 0 else columns - 1) + (0 if sign_y > 0 else (rows - 1) * columns)
        step_x, step_y = sign_x, sign_y * columns
        frame = (origin, step_x, step_y, x, y) if steep else (origin, step_y, step_x, y, x)
        sweep_octant(opaque, turns, distance, parent, queue, cones, source, index, frame, (lo, hi), _SLACK_CELLS)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _start(
    opaque: BoolArray, walls: BoolArray, distance: Float64Array, x: float, y: float, reach: float
) -> list[tuple[float, int]]:
    """Queue the cells from which everything starts: those in sight of a goal that is itself not traversable."""
    queue = [(0.0, 0)]
    queue.clear()
    rows, columns = opaque.shape
    for row in range(max(0, int(y - reach)), min(rows, int(y + reach) + 1)):
        for column in range(max(0, int(x - reach)), min(columns, int(x + reach) + 1)):
            straight = math.sqrt((column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2)
            if opaque[row, column] or straight > reach:
                continue
            if segment_is_clear(walls, x, y, column + 0.5, row + 0.5):
                distance[row, column] = straight
                heapq.heappush(queue, (straight, row * columns + column))
    return queue


@njit(cache=True)  # type: ignore[untyped-decorator]
def _solve(opaque: BoolArray, walls: BoolArray, x: float, y: float, reach: float) -> Float64Array:
    """Distances of the traversable cells of padded arrays from a goal at (x, y), all in cells; float64 [Y, X]."""
    shape = rows, columns = opaque.shape
    convex, turns = _find_turns(opaque)
    distance = np.full(opaque.shape, np.inf)
    parent = np.full(opaque.size, _NO_PARENT, np.int32)
    cones = np.empty((2, max(rows, columns) + 2, 2))
    done = np.zeros(opaque.size, np.bool_)
    flat, flat_turns, flat_distance = opaque.ravel(), turns.ravel(), distance.ravel()
    everywhere = (0.0, 0.0, 0.0, 0.0, 0.0)
    queue = [(0.0, 0)]
    queue.clear()
    if opaque[int(y), int(x)]:
        queue = _start(opaque, walls, distance, x, y, reach)
    else:
        distance[int(y), int(x)] = math.sqrt((int(x) + 0.5 - x) ** 2 + (int(y) + 0.5 - y) ** 2)
        _sweep_wedge(shape, flat, flat_turns, flat_distance, parent, queue, cones, (x, y, 0.0), _GOAL, everywhere)
    while True:
        if len(queue) == 0:
            _queue_overlooked(opaque, distance, queue)
        if len(queue) == 0:
            return distance
        value, cell = heapq.heappop(queue)
        if done[cell] or value > flat_distance[cell]:
            continue
        done[cell] = True
        row, column, before = cell // columns, cell % columns, parent[cell]
        source = (column + 0.5, row + 0.5, value)
        if before == _NO_PARENT:
            _sweep_wedge(shape, flat, flat_turns, flat_distance, parent, queue, cones, source, cell, everywhere)
            continue
        dx = source[0] - (x if before == _GOAL else before % columns + 0.5)
        dy = source[1] - (y if before == _GOAL else before // columns + 0.5)
        for side in (1.0, -1.0):
            ex, ey = _bend(convex, row, column, dx, dy, side)
            if ex != 0.0:
                wedge = (side, dx, dy, ex, ey)
                _sweep_wedge(shape, flat, flat_turns, flat_distance, parent, queue, cones, source, cell, wedge)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _queue_overlooked(opaque: BoolArray, distance: Float64Array, queue: list[tuple[float, int]]) -> None:
    """Queue traversable cells without a distance that lie beside one with it.

    Dropping rays that look useless may, in a view one cell wide, leave cells behind; connected cells are reached still.
    """
    rows, columns = opaque.shape
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            if opaque[row, column] or distance[row, column] < np.inf:
                continue
            beside = min(distance[row, column - 1], distance[row, column + 1])
            best = min(beside, distance[row - 1, column], distance[row + 1, column]) + 1.0
            if best < np.inf:
                distance[row, column] = best
                heapq.heappush(queue, (best, row * columns + column))
