"""Points on surfaces, evenly spread."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.synth.render.surface import Surface


def sample_surface(
    surface: Surface, spacing_m: float, chosen: BoolArray | None = None
) -> tuple[Float64Array, NDArray[np.int64]]:
    """Points on patches on a regular grid, their edges included, neighbours no farther apart than `spacing_m`.

    Every patch, however small, gets points, and none of its points is off it.

    Args:
        surface: patches.
        spacing_m: largest distance between neighbouring points along a patch's edges, m.
        chosen: which patches; all when None; bool [P].

    Returns:
        Points [N, 3], m, and the patch of each [N].
    """
    edges = np.linalg.norm(surface.points_m[:, 1:] - surface.points_m[:, :1], axis=-1)
    cells = np.maximum(np.ceil(edges / spacing_m), 1).astype(np.int64)
    counts = (cells + 1).prod(axis=1)
    counts[~surface.quad] = _triangle_counts(cells[~surface.quad])
    if chosen is not None:
        counts[~chosen] = 0
    points = np.empty((int(counts.sum()), 3))
    _fill(surface.points_m, surface.quad, cells, counts, points)
    return points, np.repeat(np.arange(len(surface)), counts)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _triangle_counts(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many points of grids of m x n cells lie in the half below the diagonal."""
    counts = np.zeros(len(cells), np.int64)
    for p in range(len(cells)):
        m, n = cells[p, 0], cells[p, 1]
        for j in range(n + 1):
            counts[p] += (m * (n - j)) // n + 1
    return counts


@njit(cache=True)  # type: ignore[untyped-decorator]
def _fill(
    corners: Float64Array, quad: BoolArray, cells: NDArray[np.int64], counts: NDArray[np.int64], points: Float64Array
) -> None:
    k = 0
    for p in range(len(corners)):
        if counts[p] == 0:
            continue
        m, n = cells[p, 0], cells[p, 1]
        for j in range(n + 1):
            last = m if quad[p] else (m * (n - j)) // n
            for i in range(last + 1):
                s, t = i / m, j / n
                for axis in range(3):
                    a = corners[p, 0, axis]
                    points[k, axis] = a + s * (corners[p, 1, axis] - a) + t * (corners[p, 2, axis] - a)
                k += 1
