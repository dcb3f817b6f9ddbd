import numpy as np
import pytest

from wsm_data.geometry.smoothing import smoothed_poses
from wsm_data.geometry.transform import rotation_angle_rad


def turned_about_z(angles_rad):
    T = np.tile(np.eye(4), (len(angles_rad), 1, 1))
    T[:, 0, 0], T[:, 0, 1] = np.cos(angles_rad), -np.sin(angles_rad)
    T[:, 1, 0], T[:, 1, 1] = np.sin(angles_rad), np.cos(angles_rad)
    return T


def test_steady_motion_stays_as_it_is():
    """The mean of equal steps around a moment is that moment, along a line and about an axis."""
    T = turned_about_z(0.02 * np.arange(20))
    T[:, 0, 3] = 0.05 * np.arange(20)
    np.testing.assert_allclose(smoothed_poses(T, 3), T, atol=1e-12)


def test_positions_are_means_of_as_many_on_both_sides():
    T = np.tile(np.eye(4), (6, 1, 1))
    T[:, 0, 3] = [0, 6, 0, 0, 12, 0]
    np.testing.assert_allclose(smoothed_poses(T, 2)[:, 0, 3], [0, 2, 18 / 5, 18 / 5, 4, 0], atol=1e-12)


def test_jitter_falls_with_the_root_of_the_number_of_poses():
    """Of seven independent angles the mean deviates by 1 / sqrt(7) = 0.38 of one."""
    angles = np.random.default_rng(0).normal(size=4000) * 0.01
    smooth = smoothed_poses(turned_about_z(angles), 3)[3:-3]
    assert np.sqrt(np.mean(rotation_angle_rad(smooth[:, :3, :3]) ** 2)) == pytest.approx(0.01 / np.sqrt(7), rel=0.05)


def test_rotations_stay_rotations():
    T = turned_about_z(np.random.default_rng(1).uniform(-1, 1, size=30))
    R = smoothed_poses(T, 3)[:, :3, :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.tile(np.eye(3), (30, 1, 1)), atol=1e-12)
    assert np.all(np.linalg.det(R) > 0)


def test_no_reach_changes_nothing():
    T = turned_about_z(np.array([0.1, 0.5, -0.3]))
    np.testing.assert_allclose(smoothed_poses(T, 0), T, atol=1e-15)
