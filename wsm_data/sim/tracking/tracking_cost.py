"""The cost that the tracking controller minimises, with its exact first and second derivatives.

A unicycle is driven by explicit Euler steps: p[i+1] = p[i] + T v[i] (cos h[i], sin h[i]), h[i+1] = h[i] + T w[i]. The
unknowns are the 15 speeds v and the 15 turning rates w, in one vector [v, w]; positions follow from them, so no
constraint is left but the bounds. The cost is the sum of 0.02 v^2 + 0.15 w^2 over all steps, and of
10 |p[i] - reference i/3|^2 over i = 0, 3, 6, 9, 12.
"""

import math

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float64Array

STEPS = 15
UNKNOWNS = 2 * STEPS
_STEP_S = 0.1
_EVERY = 3
_TRACKED = 5
_SPEED_WEIGHT, _TURN_WEIGHT, _POSITION_WEIGHT = 0.02, 0.15, 10.0


@njit(cache=True)  # type: ignore[untyped-decorator]
def drive(controls: Float64Array, pose: Float64Array, states: Float64Array) -> None:
    """Fill `states` [16, 4] with x, y, cos h and sin h from `pose` (x, y, h) on."""
    heading = pose[2]
    states[0, 0], states[0, 1] = pose[0], pose[1]
    for i in range(STEPS):
        states[i, 2], states[i, 3] = math.cos(heading), math.sin(heading)
        states[i + 1, 0] = states[i, 0] + _STEP_S * controls[i] * states[i, 2]
        states[i + 1, 1] = states[i, 1] + _STEP_S * controls[i] * states[i, 3]
        heading += _STEP_S * controls[STEPS + i]


@njit(cache=True)  # type: ignore[untyped-decorator]
def cost(controls: Float64Array, states: Float64Array, references: Float64Array) -> float:
    """The cost of controls [30] that lead through `states` (see `drive`)."""
    total = 0.0
    for i in range(STEPS):
        total += _SPEED_WEIGHT * controls[i] ** 2 + _TURN_WEIGHT * controls[STEPS + i] ** 2
    for k in range(_TRACKED):
        dx, dy = states[_EVERY * k, 0] - references[k, 0], states[_EVERY * k, 1] - references[k, 1]
        total += _POSITION_WEIGHT * (dx * dx + dy * dy)
    return total


@njit(cache=True)  # type: ignore[untyped-decorator]
def derivatives(
    controls: Float64Array,
    states: Float64Array,
    references: Float64Array,
    gradient: Float64Array,
    hessian: Float64Array,
) -> None:
    """Fill the gradient [30] and the Hessian [30, 30] of `cost`.

    With p the position after n steps: dp/dv[j] = T (cos h[j], sin h[j]) and dp/dw[l] = T J (p - p[l+1]), J the quarter
    turn to the left, for j, l < n; the second derivatives are T^2 J (cos h[j], sin h[j]) for l < j and
    -T^2 (p - p[max(l, m) + 1]).
    """
    hessian[:] = 0.0
    for i in range(STEPS):
        gradient[i], gradient[STEPS + i] = 2 * _SPEED_WEIGHT * controls[i], 2 * _TURN_WEIGHT * controls[STEPS + i]
        hessian[i, i], hessian[STEPS + i, STEPS + i] = 2 * _SPEED_WEIGHT, 2 * _TURN_WEIGHT
    jacobian = np.zeros((UNKNOWNS, 2))
    weight = 2 * _POSITION_WEIGHT
    for k in range(1, _TRACKED):
        n = _EVERY * k
        x, y = states[n, 0], states[n, 1]
        dx, dy = weight * (x - references[k, 0]), weight * (y - references[k, 1])
        for j in range(n):
            jacobian[j, 0], jacobian[j, 1] = _STEP_S * states[j, 2], _STEP_S * states[j, 3]
            jacobian[STEPS + j, 0] = -_STEP_S * (y - states[j + 1, 1])
            jacobian[STEPS + j, 1] = _STEP_S * (x - states[j + 1, 0])
        for a in range(UNKNOWNS):
            gradient[a] += dx * jacobian[a, 0] + dy * jacobian[a, 1]
            for b in range(UNKNOWNS):
                hessian[a, b] += weight * (jacobian[a, 0] * jacobian[b, 0] + jacobian[a, 1] * jacobian[b, 1])
        for i in range(n):
            for j in range(n):
                if j > i:
                    mixed = _STEP_S**2 * (dy * states[j, 2] - dx * states[j, 3])
                    hessian[j, STEPS + i] += mixed
                    hessian[STEPS + i, j] += mixed
                last = max(i, j) + 1
                hessian[STEPS + i, STEPS + j] -= _STEP_S**2 * (dx * (x - states[last, 0]) + dy * (y - states[last, 1]))
