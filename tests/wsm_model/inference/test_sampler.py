"""The sampler."""

import pytest
import torch

from wsm_model.inference.sampler import flow_schedule, integrate


def test_eight_steps_have_the_flow_times_of_the_specification():
    """Section 8: 1, .972, .9375, .893, .833, .75, .625, .417; then the end."""
    wanted = [1, 0.972, 0.9375, 0.893, 0.833, 0.75, 0.625, 0.417, 0]
    assert flow_schedule(8, 5.0) == pytest.approx(wanted, abs=5e-4)


@pytest.mark.parametrize("steps", [1, 3, 8])
def test_a_straight_flow_is_followed_to_its_end_in_any_number_of_steps(steps):
    clean, noise = torch.randn(2, 3, 4).double().unbind(0)
    found = integrate(lambda _x, _tau: noise - clean, noise, flow_schedule(steps, 5.0))
    torch.testing.assert_close(found, clean)


def test_no_step_is_no_sampler():
    with pytest.raises(ValueError, match="at least one step"):
        flow_schedule(0, 5.0)
