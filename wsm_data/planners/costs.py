"""What it costs a robot to stand in each cell of a map, and the cheapest way between two cells."""

import heapq
import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import ndimage

from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid

_TIGHT_M = 0.05
"""Where the centre is nearer to an obstacle than the radius less this, nobody drives."""

_CROWDING, _TOUCHING, _STEEPNESS_PER_M, _UNKNOWN_PRICE = 2.0, 10.0, 400.0, 1.2


@dataclass(frozen=True, kw_only=True)
class Caution:
    """Distances that are kept from obstacles beyond the robot's radius.

    Attributes:
        margin_m: less is paid for dearly, the more the less it is, so that the way out of it leads straight away, m.
        comfort_m: nearer than this a metre costs a little more, m.
    """

    margin_m: float
    comfort_m: float


def prices(grid: OccupancyGrid, radius_m: float, caution: Caution, *, through_unknown: bool) -> Float64Array:
    """Cost of a metre in each cell, infinite where the robot does not fit; float64 [Y, X].

    Args:
        grid: the map.
        radius_m: radius of the robot, m.
        caution: how far it keeps away.
        through_unknown: whether unknown cells may be driven through, a little dearer than known ones.
    """
    occupied = grid.cells == OCCUPIED
    room = ndimage.distance_transform_edt(np.pad(~occupied, 1, constant_values=True))[1:-1, 1:-1] * grid.resolution_m
    if not occupied.any():
        room = np.full(occupied.shape, np.inf)
    lack = np.clip((radius_m + caution.comfort_m - room) / (caution.comfort_m - caution.margin_m), 0.0, 1.0)
    price = 1.0 + _CROWDING * lack**2
    unknown = grid.cells == UNKNOWN
    price[unknown] *= _UNKNOWN_PRICE if through_unknown else np.inf
    missing = radius_m + caution.margin_m - room
    price[missing > 0] *= _TOUCHING + _STEEPNESS_PER_M * missing[missing > 0]
    price[room < radius_m - _TIGHT_M] = np.inf
    return price


@njit(cache=True)  # type: ignore[untyped-decorator]
def cheapest_way(price: Float64Array, start: tuple[int, int], goal: tuple[int, int]) -> np.ndarray:
    """Cells of the cheapest way from start to goal, by steps to the eight neighbours (A*).

    Args:
        price: of a cell's side, at least 1; infinite where there is no way; float64 [Y, X].
        start: (row, column), whatever its price.
        goal: (row, column), whatever its price.

    Returns:
        (row, column) of each cell, both ends included; int64 [N, 2]. Empty where there is no way.
    """
    rows, columns = price.shape
    known = np.full(price.size, np.inf)
    before = np.full(price.size, -1, np.int64)
    done = np.zeros(price.size, np.bool_)
    first, last = start[0] * columns + start[1], goal[0] * columns + goal[1]
    known[first] = 0.0
    queue = [(0.0, first)]
    while len(queue) > 0:
        _, cell = heapq.heappop(queue)
        if done[cell]:
            continue
        done[cell] = True
        if cell == last:
            return _back_from(last, before, columns)
        row, column = cell // columns, cell % columns
        for down in range(-1, 2):
            for right in range(-1, 2):
                i, j = row + down, column + right
                if not (0 <= i < rows and 0 <= j < columns) or (down == 0 and right == 0):
                    continue
                beside = i * columns + j
                step = price[i, j] if beside != last else min(price[i, j], 100.0)
                reached = known[cell] + math.sqrt(down * down + right * right) * step
                if reached < known[beside]:
                    known[beside] = reached
                    before[beside] = cell
                    dx, dy = abs(j - goal[1]), abs(i - goal[0])
                    rest = max(dx, dy) + (math.sqrt(2) - 1) * min(dx, dy)
                    heapq.heappush(queue, (reached + rest, beside))
    return np.zeros((0, 2), np.int64)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _back_from(last: int, before: np.ndarray, columns: int) -> np.ndarray:
    count, cell = 1, last
    while before[cell] >= 0:
        cell = before[cell]
        count += 1
    way = np.empty((count, 2), np.int64)
    cell = last
    for i in range(count - 1, -1, -1):
        way[i, 0], way[i, 1] = cell // columns, cell % columns
        cell = before[cell]
    return way


@njit(cache=True)  # type: ignore[untyped-decorator]
def shortened(price: Float64Array, way: np.ndarray) -> np.ndarray:
    """The corners of a way [N, 2] that remain when straight pieces replace whatever they are no dearer than.

    Steps to eight neighbours zigzag; the straight piece between two cells is shorter, and is taken where the cells
    under it cost no more in sum.
    """
    sums = np.zeros(len(way))
    for i in range(1, len(way)):
        sums[i] = sums[i - 1] + _straight_cost(price, way[i - 1], way[i])
    kept = [0]
    at = 0
    while at < len(way) - 1:
        best = at + 1
        for ahead in range(at + 2, len(way)):
            if _straight_cost(price, way[at], way[ahead]) <= sums[ahead] - sums[at] + 1e-9:
                best = ahead
        kept.append(best)
        at = best
    return way[np.array(kept)]


@njit(cache=True)  # type: ignore[untyped-decorator]
def _straight_cost(price: Float64Array, a: np.ndarray, b: np.ndarray) -> float:
    """Price along the straight piece between two cell centres, in cells, sampled every half a cell."""
    down, right = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(float(down * down + right * right))
    samples = max(2, int(2 * length))
    total = 0.0
    for k in range(samples):
        share = (k + 0.5) / samples
        total += price[math.floor(a[0] + share * down + 0.5), math.floor(a[1] + share * right + 0.5)]
    return total / samples * length
