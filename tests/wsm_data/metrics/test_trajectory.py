import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m, ate_se3, ate_sim3, sim3_residual_m


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


def test_the_residual_is_that_of_the_alignment_and_defined_on_a_straight_way_too(path_m):
    """Mirrored estimates too: a similarity does not mirror. To 1e-9 of paths of some metres."""
    rng = np.random.default_rng(1)
    for estimated in (path_m + 0.3 * rng.normal(size=path_m.shape), path_m * [1, 1, -1], 3 * path_m[::-1]):
        assert sim3_residual_m(estimated, path_m) == pytest.approx(ate_sim3(estimated, path_m).rmse_m, abs=1e-9)
    line = np.outer(np.arange(10.0), [1, 2, 0])
    assert sim3_residual_m(5 * line, line) == pytest.approx(0, abs=1e-6)  # the root of what rounding leaves
    assert sim3_residual_m(np.zeros((10, 3)), line) == pytest.approx(np.sqrt(np.mean(5 * (np.arange(10) - 4.5) ** 2)))
