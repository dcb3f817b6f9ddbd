"""What is measured on held-out clips."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from wsm_model.evaluation.held_out import clip_errors, estimate_states, flow_matching_errors
from wsm_model.inference.session import SessionConfig

CONFIG = SessionConfig(chunk_size=2, cache_latents=16)


@pytest.fixture
def batch(make_poses, make_spans):
    torch.manual_seed(0)
    poses = make_poses(2, 5, 4)
    poses[:, 0] = torch.tensor([0.0, 0, 0, 1, 0, 0, 0])
    return SimpleNamespace(
        still=torch.zeros(2, 5, 4, dtype=torch.bool),
        rgb=torch.randn(2, 5, 6, 4, 6),
        depth=torch.randn(2, 5, 6, 4, 6),
        poses=poses,
        spans=make_spans([5, 4], [2, 2]),
        goal_camera0_m=torch.randn(2, 3),
        refs=np.arange(2),
        keys=("a", "b"),
        epoch=0,
        step=0,
    )


def test_every_latent_keeps_the_last_of_its_estimates(make_model, batch):
    model = make_model()
    depth, poses = estimate_states(model, batch.rgb[0], CONFIG)
    whole_chunk, _ = estimate_states(model, batch.rgb[0, :3], CONFIG)
    assert torch.equal(depth[:3], whole_chunk)
    assert (poses[..., 3:].norm(dim=-1) - 1).abs().max() < 1e-5


def test_a_camera_that_stays_where_it_was_has_the_error_of_zero_motion(make_model, batch):
    model = make_model()
    head = model.expert(model.config.experts[-1]).head
    torch.nn.init.zeros_(head.linear_2.weight)
    head.linear_2.bias.data = torch.tensor([0.0, 0, 0, 1, 0, 0, 0])
    for one in clip_errors(model, batch, CONFIG):
        assert one.ate_rmse_unaligned_m == pytest.approx(one.ate_rmse_zero_motion_m, rel=1e-6)
        assert one.mean_depth_mse == pytest.approx(1.0, abs=0.2)  # standard normal latents


def test_still_frames_that_were_added_do_not_count(make_model, batch):
    model = make_model()
    batch.still[:, 3:] = True
    before = clip_errors(model, batch, CONFIG)
    batch.poses[:, 3:, :, :3] += 7.0
    for one, other in zip(before, clip_errors(model, batch, CONFIG), strict=True):
        assert (one.ate_rmse_unaligned_m, one.ate_rmse_zero_motion_m) == (
            other.ate_rmse_unaligned_m,
            other.ate_rmse_zero_motion_m,
        )
        assert one.ate_rmse_constant_velocity_m == other.ate_rmse_constant_velocity_m


def test_copying_is_exact_where_nothing_changes_and_the_unconditional_guess_is_right_on_average(make_model, batch):
    model = make_model()
    batch.rgb = batch.rgb[:, :1].expand(-1, 5, -1, -1, -1).clone()
    errors = flow_matching_errors(model, [batch], seed=0, shift=5.0)
    assert errors.copy == pytest.approx(0.0, abs=1e-9)
    assert 0 < errors.unconditional < 2.2  # at most the variance of eps - x, times weights of mean one
