import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.alignment import Similarity
from wsm_data.metrics.icp import IcpConfig, icp_rigid, thin_cloud


def test_a_planted_motion_of_the_very_same_points_is_recovered(corner_m):
    planted = Similarity(
        scale=1.0,
        rotation=Rotation.from_euler("zyx", [1.0, -0.7, 0.5], degrees=True).as_matrix(),
        translation_m=np.array([0.02, -0.03, 0.015]),
    )
    fine = IcpConfig(voxel_m=1e-4, max_iterations=300, tolerance_m=1e-9)  # no thinning: every point keeps its partner
    found = icp_rigid(corner_m[::4], planted.apply(corner_m[::4]), fine)
    np.testing.assert_allclose(found.apply(corner_m), planted.apply(corner_m), atol=1e-6)


def test_thinned_clouds_are_laid_on_one_another_within_half_a_voxel(corner_m):
    shift = np.array([0.03, 0.02, -0.04])
    found = icp_rigid(corner_m + shift, corner_m, IcpConfig())
    assert np.linalg.norm(found.apply(corner_m + shift) - corner_m, axis=1).max() < 0.01


def test_points_beyond_the_correspondence_have_no_say(corner_m):
    far = np.random.default_rng(1).uniform(5, 6, (3000, 3))
    with_far = icp_rigid(np.concatenate([corner_m + 0.02, far]), corner_m, IcpConfig())
    without = icp_rigid(corner_m + 0.02, corner_m, IcpConfig())
    np.testing.assert_allclose(with_far.translation_m, without.translation_m, atol=1e-5)


def test_clouds_that_never_meet_are_refused(corner_m):
    with pytest.raises(DataError) as refusal:
        icp_rigid(corner_m + 50.0, corner_m, IcpConfig())
    assert refusal.value.reason == Reason.TRAJECTORY_DEGENERATE


def test_thinning_leaves_the_mean_of_each_cube():
    points = np.array([[0.001, 0.001, 0.001], [0.003, 0.001, 0.001], [-0.001, 0.0, 0.0], [0.05, 0.05, 0.05]])
    assert thin_cloud(points, 0.02).tolist() == [[-0.001, 0.0, 0.0], [0.002, 0.001, 0.001], [0.05, 0.05, 0.05]]


def test_settings_must_be_positive():
    with pytest.raises(ValueError, match="voxel_m must be positive"):
        IcpConfig(voxel_m=0.0)
