"""Near-duplicate paths: two that run beside each other from start to end, by their discrete Frechet distance.

Eiter and Mannila, "Computing discrete Frechet distance", TU Wien CD-TR 94/64 (1994): the shortest leash with which two
walkers can go along two polylines from point to point without ever going back. Unlike the Hausdorff distance it tells
a way there from the way back.
"""

from dataclasses import dataclass

import numba
import numpy as np

from wsm_data.schema.arrays import Float32Array

SAME_FLOOR_M = 0.5
"""Floors of one scene whose heights differ by more are different floors: paths one above the other are two paths."""


@dataclass(frozen=True, kw_only=True)
class DiversityConfig:
    """When two paths count as one.

    Attributes:
        within_m: two paths on one floor of a physical scene whose discrete Frechet distance is at most this are
            near-duplicates, of which the first to come is taken: the hardest, but for quotas; m, 0 to take all. Paths
            are compared as 32 evenly spaced points: that moves the distance by half their spacing at most.
    """

    within_m: float = 0.5

    def __post_init__(self) -> None:
        if not 0 <= self.within_m < np.inf:
            raise ValueError(f"within_m must be 0 or more, found {self.within_m}")


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def discrete_frechet_m(a: Float32Array, b: Float32Array) -> float:
    """Discrete Frechet distance of two polylines, m.

    Args:
        a: points, m; float [P, 2].
        b: points, m; float [Q, 2].
    """
    leash = np.empty(len(b))  # row i of the table: shortest leash that reaches points (i, j)
    for i in range(len(a)):
        diagonal = 0.0  # the value at (i - 1, j - 1)
        for j in range(len(b)):
            above = leash[j]
            if i == 0 and j == 0:
                way = 0.0
            elif i == 0:
                way = leash[j - 1]
            elif j == 0:
                way = above
            else:
                way = min(above, diagonal, leash[j - 1])
            diagonal = above
            leash[j] = max(way, _distance_m(a[i], b[j]))
    return float(leash[-1])


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def paths_are_near(a: Float32Array, b: Float32Array, within_m: float) -> bool:
    """Whether the discrete Frechet distance of two polylines is at most `within_m`.

    The ends are compared first: the walkers start and stop together, so the distance is no less than that of the first
    points, nor of the last. Most pairs are told apart by this, and most others by the first row that cannot be reached.
    """
    if _distance_m(a[0], b[0]) > within_m or _distance_m(a[-1], b[-1]) > within_m:
        return False
    reached = np.zeros(len(b), np.bool_)
    for i in range(len(a)):
        diagonal = False
        any_reached = False
        for j in range(len(b)):
            above = reached[j]
            came = (i == 0 and j == 0) or (i > 0 and above) or (j > 0 and (reached[j - 1] or diagonal))
            diagonal = above
            reached[j] = came and _distance_m(a[i], b[j]) <= within_m
            any_reached = any_reached or reached[j]
        if not any_reached:
            return False
    return bool(reached[-1])


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _distance_m(p: Float32Array, q: Float32Array) -> float:
    # Numba's float() of a float32 is a float32.
    return float(np.hypot(np.float64(p[0]) - np.float64(q[0]), np.float64(p[1]) - np.float64(q[1])))
