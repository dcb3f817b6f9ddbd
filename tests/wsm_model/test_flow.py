"""The path from latents to noise."""

import pytest
import torch

from wsm_model.config import Prediction
from wsm_model.flow import LEAST_FLOW_TIME, noised, shifted_flow_time, velocity_of


def test_flow_times_are_shifted_towards_noise_and_keep_their_ends():
    uniform = torch.tensor([0.0, 0.5, 1.0])
    assert shifted_flow_time(uniform, 5.0).tolist() == pytest.approx([0.0, 5 / 6, 1.0])
    assert torch.equal(shifted_flow_time(uniform, 1.0), uniform)


def test_at_time_0_there_is_the_latent_and_at_time_1_the_noise():
    clean, noise = torch.randn(2, 2, 3, 1, 2, 2).unbind(0)
    times = torch.tensor([[0.0, 1.0, 0.5], [1.0, 0.0, 0.25]])
    found = noised(clean, noise, times)
    assert torch.equal(found[0, 0], clean[0, 0])
    assert torch.equal(found[0, 1], noise[0, 1])
    torch.testing.assert_close(found[1, 2], 0.75 * clean[1, 2] + 0.25 * noise[1, 2])


def test_the_true_latent_stands_for_the_true_velocity():
    clean, noise = torch.randn(2, 2, 3, 1, 2, 2).unbind(0)
    times = torch.tensor([[0.05, 1.0, 0.5], [0.9, 0.1, 0.25]])
    noisy = noised(clean, noise, times)
    found = velocity_of(Prediction.CLEAN, clean, noisy, times)
    torch.testing.assert_close(found, noise - clean, rtol=1e-4, atol=1e-5)
    assert velocity_of(Prediction.VELOCITY, noise, noisy, times) is noise


def test_an_error_of_the_latent_counts_by_its_time_and_not_without_bound():
    """v = (x_tau - x) / tau: an error of 1 in x is one of 1 / tau in v, and of 20 at most."""
    times = torch.tensor([1.0, 0.5, 0.1, 0.0])
    noisy = torch.zeros(4, 1, 1, 1)
    found = velocity_of(Prediction.CLEAN, -torch.ones(4, 1, 1, 1), noisy, times)
    assert found.flatten().tolist() == pytest.approx([1.0, 2.0, 10.0, 1 / LEAST_FLOW_TIME])
