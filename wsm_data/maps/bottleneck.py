"""Ways through a grid whose worst cell is as good as can be: minimax paths.

The least over all ways of the highest level on the way is the elevation that a flood from the seeds must rise to before
it wets a cell. It is computed as Priority-Flood computes it (Barnes, Lehman and Mulla, "Priority-flood", Computers &
Geosciences 62, 2014): the lowest cell of the rim is taken next, and cells below the water go to a plain queue.
With clearance as a negative level the same is the widest path (Pollack, "The maximum capacity through a network",
Operations Research 8, 1960).
"""

import heapq

import numpy as np
from numba import njit

from wsm_data.schema.arrays import BoolArray, Float64Array


def flood_levels(level: Float64Array, passable: BoolArray, seeds: BoolArray, wanted: BoolArray) -> Float64Array:
    """The least highest level on any way from a seed to each wanted cell, both ends included.

    Steps go to the eight neighbours. The flood ends when all wanted cells that can be reached are wet.

    Args:
        level: what is to be kept low on the way; float64 [Y, X].
        passable: where ways may lead; bool [Y, X].
        seeds: where they start; those that are not passable are passed over; bool [Y, X].
        wanted: cells whose level is asked for; bool [Y, X].

    Returns:
        float64 [Y, X]; infinite at cells that no way reaches, and at cells that were not wanted and not yet wet.
    """
    return _flood(
        np.ascontiguousarray(level),
        np.ascontiguousarray(passable),
        seeds & passable,
        int((wanted & passable).sum()),
        wanted,
    )


@njit(cache=True)  # type: ignore[untyped-decorator]
def _flood(level: Float64Array, passable: BoolArray, seeds: BoolArray, missing: int, wanted: BoolArray) -> Float64Array:
    rows, columns = level.shape
    found = np.full(level.shape, np.inf)
    queued = seeds.copy()
    rim = [(level[0, 0], 0)]
    rim.clear()
    below = [0]
    below.clear()
    for row in range(rows):
        for column in range(columns):
            if seeds[row, column]:
                heapq.heappush(rim, (level[row, column], row * columns + column))
    water = -np.inf
    while missing > 0 and (len(below) > 0 or len(rim) > 0):
        if len(below) > 0:
            cell = below.pop()
        else:
            height, cell = heapq.heappop(rim)
            water = max(water, height)
        row, column = cell // columns, cell % columns
        found[row, column] = water
        missing -= wanted[row, column]
        for y in range(max(0, row - 1), min(rows, row + 2)):
            for x in range(max(0, column - 1), min(columns, column + 2)):
                if queued[y, x] or not passable[y, x]:
                    continue
                queued[y, x] = True
                if level[y, x] <= water:
                    below.append(y * columns + x)
                else:
                    heapq.heappush(rim, (level[y, x], y * columns + x))
    return found
