"""Minima against scipy's bounded search."""

import numpy as np
import pytest
from scipy.optimize import minimize

from wsm_data.sim.tracking.interior_point import minimise
from wsm_data.sim.tracking.tracking_cost import STEPS, UNKNOWNS, cost, drive


def value(controls, pose, references):
    states = np.empty((STEPS + 1, 4))
    drive(controls, pose, states)
    return cost(controls, states, references)


@pytest.mark.parametrize("seed", range(6))
def test_no_bounded_search_from_the_minimum_finds_a_lower_one(seed):
    rng = np.random.default_rng(seed)
    pose, references = rng.normal(size=3), rng.normal(size=(5, 2))
    found = minimise(np.zeros(UNKNOWNS), pose, references, 0.5)
    assert ((found[:STEPS] >= 0) & (found[:STEPS] <= 0.5) & (np.abs(found[STEPS:]) <= 0.5)).all()
    bounds = [(0.0, 0.5)] * STEPS + [(-0.5, 0.5)] * STEPS
    searched = minimize(
        value, found, args=(pose, references), bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-14}
    )
    assert value(found, pose, references) == pytest.approx(searched.fun, abs=1e-6)


def test_a_reference_where_the_robot_stands_needs_no_control():
    np.testing.assert_allclose(minimise(np.zeros(UNKNOWNS), np.zeros(3), np.zeros((5, 2)), 0.5), 0.0, atol=1e-3)
