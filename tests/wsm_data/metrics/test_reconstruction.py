import numpy as np
import pytest

from wsm_data.metrics.icp import IcpConfig
from wsm_data.metrics.reconstruction import reconstruction_errors


def grid_m(z=0.0):
    x, y = np.meshgrid(np.arange(60) * 0.04, np.arange(40) * 0.04)
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def test_an_offset_off_the_plane_is_each_point_s_distance():
    errors = reconstruction_errors(grid_m(0.02), grid_m(), None)
    for name in ("acc_rmse_m", "acc_mean_m", "acc_median_m", "comp_mean_m", "comp_median_m"):
        assert getattr(errors, name) == pytest.approx(0.02, abs=1e-12), name
    assert errors.comp_within_5cm == 1.0


def test_mean_median_and_root_mean_square_tell_outliers_apart():
    predicted = grid_m()
    predicted[::4, 2] = 0.4  # a quarter is 0.4 m off: mean 0.1, median 0, rms 0.2
    errors = reconstruction_errors(predicted, grid_m(), None)
    found = errors.acc_rmse_m, errors.acc_mean_m, errors.acc_median_m
    assert found == pytest.approx((0.2, 0.1, 0.0), abs=1e-12)


def test_what_was_not_reconstructed_lowers_completeness_alone():
    errors = reconstruction_errors(grid_m()[: 30 * 60], grid_m(), None)  # 30 of 40 rows
    assert errors.acc_rmse_m == 0.0
    assert errors.comp_mean_m == pytest.approx(np.arange(1, 11).sum() * 0.04 / 40, abs=1e-12)
    assert errors.comp_within_5cm == pytest.approx(31 / 40)  # one missing row is 0.04 m away, the next 0.08 m


def test_refinement_takes_a_rigid_offset_out_and_leaves_the_noise(corner_m):
    rng = np.random.default_rng(2)
    noisy = corner_m + rng.normal(size=corner_m.shape) * 0.01
    planted = noisy + np.array([0.03, -0.02, 0.025])
    raw = reconstruction_errors(noisy, corner_m, None).acc_rmse_m
    assert reconstruction_errors(planted, corner_m, None).acc_rmse_m > 2 * raw
    assert reconstruction_errors(planted, corner_m, IcpConfig()).acc_rmse_m == pytest.approx(raw, rel=0.05)
