"""A primal-dual interior point method for the tracking cost under bounds.

The problem has several local minima: a straight path that lies behind the robot is one, in which it stands still. Which
one is found is part of the benchmark. So the method follows the one that the benchmark uses (Waechter and Biegler, "On
the implementation of an interior-point filter line-search algorithm for large-scale nonlinear programming", 2006) in
all that decides it: the first point is pushed off its bounds by a hundredth of their distance, multipliers start at 1,
the barrier falls from 0.1 by the paper's equation 7, the Hessian is exact, and shifted until it is positive definite.
"""

import math

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float64Array
from wsm_data.sim.tracking.tracking_cost import STEPS, UNKNOWNS, cost, derivatives, drive

_PUSH = 0.01
_FIRST_BARRIER, _LAST_BARRIER, _TOLERANCE = 0.1, 1e-9, 1e-8
_MOST_ITERATIONS = 100


@njit(cache=True)  # type: ignore[untyped-decorator]
def minimise(start: Float64Array, pose: Float64Array, references: Float64Array, speed: float) -> Float64Array:
    """The local minimum of the tracking cost that is found from `start`.

    Args:
        start: controls [30]; pushed into the bounds.
        pose: x, y and heading of the robot; [3].
        references: the points to be near after 0, 3, 6, 9 and 12 steps; [5, 2].
        speed: bound of v, from 0 on, and of |w|.

    Returns:
        Controls, float64 [30].
    """
    lower, upper = np.zeros(UNKNOWNS), np.full(UNKNOWNS, speed)
    lower[STEPS:] = -speed
    push = _PUSH * (upper - lower)
    z = np.minimum(np.maximum(start, lower + push), upper - push)
    z_lower, z_upper = np.ones(UNKNOWNS), np.ones(UNKNOWNS)
    gradient, hessian, states = np.empty(UNKNOWNS), np.empty((UNKNOWNS, UNKNOWNS)), np.empty((STEPS + 1, 4))
    barrier, shift = _FIRST_BARRIER, 0.0
    for _ in range(_MOST_ITERATIONS):
        drive(z, pose, states)
        derivatives(z, states, references, gradient, hessian)
        below, above = z - lower, upper - z
        dual = np.abs(gradient - z_lower + z_upper).max()
        if max(dual, (z_lower * below).max(), (z_upper * above).max()) < _TOLERANCE:
            break
        while barrier > _LAST_BARRIER:
            missed = max(np.abs(z_lower * below - barrier).max(), np.abs(z_upper * above - barrier).max())
            if max(dual, missed) >= 10 * barrier:
                break
            barrier = max(_LAST_BARRIER, min(0.2 * barrier, barrier**1.5))
        slope = gradient - barrier / below + barrier / above
        for i in range(UNKNOWNS):
            hessian[i, i] += z_lower[i] / below[i] + z_upper[i] / above[i]
        step, shift = _newton_step(hessian, slope, shift)
        step_lower = barrier / below - z_lower - z_lower / below * step
        step_upper = barrier / above - z_upper + z_upper / above * step
        keep = max(0.99, 1 - barrier)
        length = keep * min(_room(below, step), _room(above, -step))
        z = _line_search(z, step, min(1.0, length), slope, barrier, (lower, upper), pose, references, states)
        dual_length = min(1.0, keep * min(_room(z_lower, step_lower), _room(z_upper, step_upper)))
        z_lower, z_upper = z_lower + dual_length * step_lower, z_upper + dual_length * step_upper
    return z


@njit(cache=True)  # type: ignore[untyped-decorator]
def _room(values: Float64Array, step: Float64Array) -> float:
    """How many times a step can be taken until the first of the positive values is zero."""
    most = np.inf
    for i in range(len(values)):
        if step[i] < 0.0:
            most = min(most, -values[i] / step[i])
    return most


@njit(cache=True)  # type: ignore[untyped-decorator]
def _line_search(
    z: Float64Array,
    step: Float64Array,
    length: float,
    slope: Float64Array,
    barrier: float,
    bounds: tuple[Float64Array, Float64Array],
    pose: Float64Array,
    references: Float64Array,
    states: Float64Array,
) -> Float64Array:
    """Halve the step until the barrier function falls as its slope promises (Armijo)."""
    before = cost(z, states, references) + _barrier_term(z, bounds, barrier)
    promised = 1e-8 * (slope * step).sum()
    tried = z + length * step
    for _ in range(30):
        drive(tried, pose, states)
        after = cost(tried, states, references) + _barrier_term(tried, bounds, barrier)
        if after <= before + length * promised + 1e-12 * abs(before):
            break
        length *= 0.5
        tried = z + length * step
    return tried


@njit(cache=True)  # type: ignore[untyped-decorator]
def _barrier_term(z: Float64Array, bounds: tuple[Float64Array, Float64Array], barrier: float) -> float:
    total = 0.0
    for i in range(len(z)):
        total -= barrier * math.log((z[i] - bounds[0][i]) * (bounds[1][i] - z[i]))
    return total


@njit(cache=True)  # type: ignore[untyped-decorator]
def _newton_step(matrix: Float64Array, slope: Float64Array, last_shift: float) -> tuple[Float64Array, float]:
    """Solve (matrix + shift I) step = -slope with the least shift tried that makes it positive definite."""
    factor = np.empty_like(matrix)
    shift = 0.0
    while not _factorise(matrix, shift, factor):
        if shift == 0.0:
            shift = 1e-4 if last_shift == 0.0 else max(1e-20, last_shift / 3)
        else:
            shift *= 100.0 if last_shift == 0.0 else 8.0
    step = -slope
    for i in range(len(step)):
        for k in range(i):
            step[i] -= factor[i, k] * step[k]
        step[i] /= factor[i, i]
    for i in range(len(step) - 1, -1, -1):
        for k in range(i + 1, len(step)):
            step[i] -= factor[k, i] * step[k]
        step[i] /= factor[i, i]
    return step, shift if shift > 0.0 else last_shift


@njit(cache=True)  # type: ignore[untyped-decorator]
def _factorise(matrix: Float64Array, shift: float, factor: Float64Array) -> bool:
    """Fill the lower Cholesky factor of matrix + shift I; False where it is not positive definite."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            total = matrix[i, j] + (shift if i == j else 0.0)
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = total / factor[j, j]
            elif total <= 1e-12:
                return False
            else:
                factor[i, i] = math.sqrt(total)
    return True
