import numpy as np
import pytest

from wsm_model.posttraining.advantages import advantages, optimality


def test_advantages_are_standardised_in_the_group():
    """Mean 2, population standard deviation sqrt(2/3)."""
    found = advantages(np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found, np.array([-1, 0, 1]) / (np.sqrt(2 / 3) + 1e-4))


def test_the_spread_of_a_step_may_divide_instead():
    np.testing.assert_allclose(advantages(np.array([1.0, 3.0]), 0.5), np.array([-1, 1]) / 0.5001)


def test_equal_rewards_are_neither_good_nor_bad():
    assert optimality(advantages(np.full(4, 0.25)), 5.0).tolist() == [0.5] * 4


@pytest.mark.parametrize(("advantage", "rho"), [(-9, 0.0), (-5, 0.0), (0, 0.5), (2.5, 0.75), (5, 1.0), (9, 1.0)])
def test_advantages_are_clipped_at_their_maximum(advantage, rho):
    assert optimality(np.array([float(advantage)]), 5.0).tolist() == [rho]
