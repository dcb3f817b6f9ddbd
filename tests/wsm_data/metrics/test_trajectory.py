import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m, ate_se3, ate_sim3


@pytest.fixture
def path_m():
    return np.cumsum(np.random.default_rng(0).normal(size=(40, 3)), axis=0)


def test_without_alignment_a_shift_counts_in_full(path_m):
    assert ate_rmse_unaligned_m(path_m + np.array([3.0, 4.0, 0.0]), path_m) == pytest.approx(5.0, abs=1e-12)


def test_a_rigid_motion_is_no_error_after_rigid_alignment(path_m):
    moved = path_m @ Rotation.from_euler("zyx", [1, 2, 3]).as_matrix().T + 7.0
    assert ate_se3(moved, path_m).rmse_m == pytest.approx(0, abs=1e-12)


def test_a_wrong_scale_is_an_error_for_se3_and_none_for_sim3(path_m):
    assert ate_sim3(path_m * 2, path_m).rmse_m == pytest.approx(0, abs=1e-12)
    assert ate_sim3(path_m * 2, path_m).alignment.scale == pytest.approx(0.5, abs=1e-12)
    spread = np.sqrt(np.square(path_m - path_m.mean(axis=0)).sum(axis=1).mean())  # 2x - x, about the mean
    assert ate_se3(path_m * 2, path_m).rmse_m == pytest.approx(spread, rel=1e-12)


def test_more_freedom_never_raises_the_error(path_m):
    noisy = path_m + np.random.default_rng(1).normal(size=path_m.shape)
    sim3, se3, none = ate_sim3(noisy, path_m).rmse_m, ate_se3(noisy, path_m).rmse_m, ate_rmse_unaligned_m(noisy, path_m)
    assert sim3 <= se3 <= none


def test_a_straight_drive_cannot_be_aligned_but_has_an_unaligned_error():
    line = np.outer(np.arange(10.0), [1.0, 0.0, 0.0])
    with pytest.raises(DataError) as refusal:
        ate_sim3(line * 1.1, line)
    assert refusal.value.reason == Reason.TRAJECTORY_DEGENERATE
    assert ate_rmse_unaligned_m(line * 1.1, line) == pytest.approx(0.1 * np.sqrt(28.5))  # mean of 0 .. 81 is 28.5


def test_trajectories_of_two_lengths_are_a_mistake_of_the_caller(path_m):
    with pytest.raises(ValueError, match="both must be"):
        ate_rmse_unaligned_m(path_m[1:], path_m)
