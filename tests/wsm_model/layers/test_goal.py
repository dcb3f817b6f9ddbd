"""The goal token."""

import math

import torch

from wsm_model.layers.goal import GoalEmbedding, fourier_features


def test_features_are_the_point_and_waves_at_doubling_frequencies():
    found = fourier_features(torch.tensor([1.0, -2.0, 0.5]), 2, math.pi / 32)
    assert found.shape == (3 + 6 * 2,)
    assert found[:3].tolist() == [1.0, -2.0, 0.5]
    wanted = [math.sin(x * math.pi / 32 * 2**k) for x in (1.0, -2.0, 0.5) for k in range(2)]
    torch.testing.assert_close(found[3:9], torch.tensor(wanted))
    torch.testing.assert_close(found[3:9] ** 2 + found[9:] ** 2, torch.ones(6))


def test_goals_within_the_longest_episode_have_features_of_their_own():
    """Half a turn in 32 m: the lowest wave tells any two points of [-16 m, 16 m] apart."""
    points = torch.linspace(-16, 16, 321)
    waves = fourier_features(torch.stack([points] * 3, dim=-1), 1, math.pi / 32)[:, 3]
    assert (waves.diff() > 0).all()


def test_a_batch_is_embedded_point_by_point():
    torch.manual_seed(0)
    embedding, goals = GoalEmbedding(4, 0.1, 16), torch.randn(2, 3)
    torch.testing.assert_close(embedding(goals)[1], embedding(goals[1]))
