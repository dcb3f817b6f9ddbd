"""What is measured on held-out clips."""

import pytest
import torch

from wsm_model.config import Expert, Variant
from wsm_model.evaluation.held_out import clip_errors


@pytest.fixture
def still_model(make_model):
    """A model that takes every camera for one that stays."""
    model = make_model(latent_channels=48)
    head = model.expert(model.config.experts[-1]).head
    torch.nn.init.zeros_(head.linear_2.weight)
    head.linear_2.bias.data = torch.tensor([0.0, 0, 0, 1, 0, 0, 0])
    return model


def test_a_camera_that_stays_where_it_was_has_the_error_of_zero_motion(still_model, batch, make_settings):
    for one in clip_errors(still_model, batch, make_settings()):
        assert one.states.ate_rmse_unaligned_m == pytest.approx(one.states.ate_rmse_zero_motion_m, rel=1e-6)
        assert one.states.mean_depth_mse == pytest.approx(1.0, abs=0.2)  # standard normal latents


def test_a_model_that_always_says_the_mean_depth_has_the_error_of_the_mean(still_model, batch, make_settings):
    projection = still_model.expert(Expert.DEPTH).head.projection
    torch.nn.init.zeros_(projection.weight)
    torch.nn.init.zeros_(projection.bias)
    for one in clip_errors(still_model, batch, make_settings()):
        assert one.states.depth_mse == pytest.approx(one.states.mean_depth_mse)


def test_still_frames_that_were_added_do_not_count(still_model, batch, make_settings):
    batch.still[:, 3:] = True
    settings = make_settings()
    before = [one.states for one in clip_errors(still_model, batch, settings)]
    batch.poses[:, 3:, :, :3] += 7.0
    after = [one.states for one in clip_errors(still_model, batch, settings)]
    assert [(one.ate_rmse_unaligned_m, one.ate_rmse_zero_motion_m, one.constant_map) for one in before] == [
        (one.ate_rmse_unaligned_m, one.ate_rmse_zero_motion_m, one.constant_map) for one in after
    ]
    assert [one.ate_rmse_constant_velocity_m for one in before] == [one.ate_rmse_constant_velocity_m for one in after]


def test_a_clip_of_which_no_cell_was_half_measured_has_no_depth_error_and_keeps_its_others(
    still_model, batch, make_settings
):
    """Sparse depth is a clip's to have: 127 of 255 is less than half."""
    batch.depth_valid[0] = 127
    sparse, dense = (one.states for one in clip_errors(still_model, batch, make_settings()))
    assert (sparse.depth, sparse.constant_map) == (None, None)
    assert sparse.ate_rmse_unaligned_m > 0
    assert dense.depth.abs_rel > dense.constant_map.abs_rel > 0  # an untrained model against the best fit
    batch.depth_valid[:] = 127
    assert [one.states.depth for one in clip_errors(still_model, batch, make_settings())] == [None, None]


def test_centres_on_one_line_have_no_aligned_error(still_model, batch, make_settings):
    batch.poses[..., 1:3] = 0.0
    assert [one.states.ate_rmse_sim3_m for one in clip_errors(still_model, batch, make_settings())] == [None, None]


def test_a_scene_that_stays_is_copied_without_error(still_model, batch, make_settings):
    batch.rgb = batch.rgb[:, :1].expand_as(batch.rgb).clone()
    for one in clip_errors(still_model, batch, make_settings()):
        assert one.dream.copy.mse == (0.0, 0.0)
        assert one.dream.copy.ssim == pytest.approx((1.0, 1.0))
        assert one.dream.shrunk_copy.mse == pytest.approx((0.0, 0.0), abs=1e-10)  # the factor is 1 up to rounding
        assert min(one.dream.dream.mse) > 0.01


def test_frames_without_anything_in_common_are_guessed_best_by_their_mean(still_model, batch, make_settings):
    """Independent latents of variance 1: a copy has twice the squared error of the mean, a factor near 0 about once."""
    for one in clip_errors(still_model, batch, make_settings()):
        assert sum(one.dream.shrunk_copy.mse) < 0.7 * sum(one.dream.copy.mse)


def test_without_slam_there_are_dreams_alone(make_model, batch, make_settings):
    model = make_model(Variant.IDM, latent_channels=48)
    found = clip_errors(model, batch, make_settings())
    assert [one.key for one in found] == ["a", "b"]
    assert [one.states for one in found] == [None, None]
    assert [len(one.dream.dream.mse) for one in found] == [2, 2]
