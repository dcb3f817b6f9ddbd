"""The weight of a flow time, and the error it weighs."""

import math

import pytest
import torch

from wsm_model.flow import noised, shifted_flow_time
from wsm_model.losses.flow import flow_errors, flow_weight

SHIFT = 5.0


def test_the_weight_has_mean_one_over_the_shifted_grid():
    grid = shifted_flow_time(torch.arange(1, 1001, dtype=torch.float64) / 1000, SHIFT)
    assert float(flow_weight(grid, SHIFT).mean()) == pytest.approx(1.0, abs=1e-9)


def test_the_weight_is_2_08_in_the_middle_and_0_at_pure_noise():
    """The figures of the specification, section 7."""
    assert float(flow_weight(torch.tensor(0.5), SHIFT)) == pytest.approx(2.08, abs=0.005)
    assert float(flow_weight(torch.tensor(1.0), SHIFT)) == 0.0
    assert float(flow_weight(torch.tensor(0.0), SHIFT)) == pytest.approx(0.0, abs=1e-6)  # as far from 1/2 as 1 is


def test_errors_equal_a_loop_over_frames():
    generator = torch.Generator().manual_seed(0)
    velocity, clean, noise = torch.randn(3, 2, 4, 5, 2, 3, generator=generator).unbind(0)
    flow_time = torch.rand(2, 4, generator=generator)
    found = flow_errors(velocity, clean, noise, flow_time, SHIFT)
    for row in range(2):
        for frame in range(4):
            error = velocity[row, frame] - (noise[row, frame] - clean[row, frame])
            wanted = (error**2).mean() * flow_weight(flow_time[row, frame], SHIFT)
            assert math.isclose(float(found[row, frame]), float(wanted), rel_tol=1e-5)


def test_the_true_velocity_leads_from_any_point_of_the_path_back_to_the_latent():
    clean, noise = torch.randn(2, 2, 3, 4).double().unbind(0)
    for tau in (0.1, 0.5, 1.0):
        there = noised(clean, noise, torch.full((2,), tau).double())
        torch.testing.assert_close(there - tau * (noise - clean), clean)
