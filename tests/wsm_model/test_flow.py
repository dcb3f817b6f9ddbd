"""The path from latents to noise."""

import pytest
import torch

from wsm_model.flow import noised, shifted_flow_time


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
