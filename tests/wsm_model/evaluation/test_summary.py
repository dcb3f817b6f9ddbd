from dataclasses import replace

import pytest

from wsm_data.metrics.depth import DepthErrors
from wsm_model.evaluation.held_out import ClipErrors, DreamErrors, PictureErrors, StateErrors
from wsm_model.evaluation.summary import summarise

NEAR, FAR = DepthErrors(abs_rel=0.1, delta1=0.9, log_rmse=0.2), DepthErrors(abs_rel=0.5, delta1=0.3, log_rmse=0.6)
STATES = StateErrors(
    ate_rmse_unaligned_m=1.0,
    ate_rmse_sim3_m=None,
    ate_rmse_zero_motion_m=3.0,
    ate_rmse_constant_velocity_m=2.0,
    depth_mse=0.25,
    mean_depth_mse=1.0,
    depth=NEAR,
    constant_map=FAR,
)
GUESS = PictureErrors(mse=(0.04, 0.4), ssim=(0.8, 0.6))
DREAM = DreamErrors(dream=GUESS, copy=replace(GUESS, mse=(0.0, 0.4)), shrunk_copy=GUESS)
CLIP = ClipErrors(key="a", states=STATES, dream=DREAM)


def test_errors_are_means_over_the_clips_that_have_them():
    other = replace(CLIP, states=replace(STATES, ate_rmse_unaligned_m=2.0, ate_rmse_sim3_m=0.5, depth=FAR))
    found = summarise([CLIP, other])
    assert found["ate_rmse_unaligned_m"] == 1.5
    assert found["ate_rmse_sim3_m"] == 0.5
    assert (found["depth_abs_rel"], found["depth_abs_rel_constant_map"]) == (pytest.approx(0.3), 0.5)
    assert found["depth_delta1"] == pytest.approx(0.6)


def test_depth_is_a_mean_over_the_clips_whose_depth_was_measured():
    unmeasured = replace(CLIP, states=replace(STATES, depth=None, constant_map=None))
    found = summarise([CLIP, unmeasured])
    assert (found["depth_abs_rel"], found["depth_abs_rel_constant_map"]) == (0.1, 0.5)
    assert summarise([unmeasured])["depth_abs_rel"] is None


def test_psnr_is_that_of_the_mean_squared_error_and_there_is_none_without_error():
    """Colours span 2: 10 log10(4 / 0.04) = 20 dB; the means of the two clips are 0.04 and 0.4."""
    found = summarise([CLIP, replace(CLIP, dream=replace(DREAM, dream=replace(GUESS, mse=(0.04,), ssim=(0.4,))))])
    assert found["dream_psnr_db"] == pytest.approx([20.0, 10.0])
    assert found["dream_ssim"] == pytest.approx([0.6, 0.6])
    assert found["copy_psnr_db"][0] is None


def test_what_no_clip_has_is_left_out():
    assert "depth_abs_rel" not in summarise([replace(CLIP, states=None)])
    assert "dream_psnr_db" not in summarise([replace(CLIP, dream=None)])
    assert summarise([replace(CLIP, states=None, dream=None)]) == {}
