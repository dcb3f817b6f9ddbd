"""Derivatives against central differences of the cost."""

import numpy as np
import pytest

from wsm_data.sim.tracking.tracking_cost import STEPS, UNKNOWNS, cost, derivatives, drive


def value(controls, pose, references):
    states = np.empty((STEPS + 1, 4))
    drive(controls, pose, states)
    return cost(controls, states, references)


def both(controls, pose, references):
    states, gradient, hessian = np.empty((STEPS + 1, 4)), np.empty(UNKNOWNS), np.empty((UNKNOWNS, UNKNOWNS))
    drive(controls, pose, states)
    derivatives(controls, states, references, gradient, hessian)
    return gradient, hessian


@pytest.mark.parametrize("seed", range(3))
def test_gradient_and_hessian_are_those_of_the_cost(seed):
    rng = np.random.default_rng(seed)
    controls, pose, references = rng.uniform(-0.5, 0.5, UNKNOWNS), rng.normal(size=3), rng.normal(size=(5, 2))
    gradient, hessian = both(controls, pose, references)
    for i, unit in enumerate(np.eye(UNKNOWNS) * 1e-5):
        up, down = controls + unit, controls - unit
        assert (value(up, pose, references) - value(down, pose, references)) / 2e-5 == pytest.approx(
            gradient[i], abs=1e-6
        )
        slope = (both(up, pose, references)[0] - both(down, pose, references)[0]) / 2e-5
        np.testing.assert_allclose(slope, hessian[i], atol=1e-6)


def test_the_cost_is_the_weighted_sum_of_squares():
    controls = np.zeros(UNKNOWNS)
    controls[0], controls[STEPS + 14] = 0.5, 0.4  # one step forward of 0.05 m; the last turn moves nothing
    references = np.tile([1.0, 2.0], (5, 1))
    wanted = 0.02 * 0.25 + 0.15 * 0.16 + 10 * (1 + 4) + 4 * 10 * (0.95**2 + 4)
    assert value(controls, np.zeros(3), references) == pytest.approx(wanted, rel=1e-12)
