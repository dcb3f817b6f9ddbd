import numpy as np
import pytest

from wsm_data.geometry.planar import camera_over, compose, points_from_base, points_in_base, relative_to
from wsm_data.geometry.transform import rigidity_error, transform_points

POSE = np.array([1.0, 2.0, np.pi / 2])


def test_a_point_ahead_lies_on_x_and_one_to_the_left_on_y():
    np.testing.assert_allclose(points_in_base(np.array([[1.0, 5.0], [0.0, 2.0]]), POSE), [[3, 0], [0, 1]], atol=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_going_there_and_back_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    pose, other, points = rng.normal(size=3), rng.normal(size=3), rng.normal(size=(4, 2))
    np.testing.assert_allclose(points_from_base(points_in_base(points, pose), pose), points, atol=1e-14)
    np.testing.assert_allclose(relative_to(compose(pose, other), pose), other, atol=1e-14)


def test_composing_poses_is_composing_the_maps_of_points():
    outer, inner, points = np.array([1.0, -1.0, 0.4]), np.array([0.3, 0.2, -1.1]), np.array([[0.5, 0.7]])
    np.testing.assert_allclose(
        points_from_base(points, compose(outer, inner)), points_from_base(points_from_base(points, inner), outer)
    )


def test_the_camera_looks_ahead_with_the_world_s_floor_below():
    T = camera_over(POSE, 0.3)
    assert rigidity_error(T) < 1e-12
    ahead_right_below = np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 0.0], [0.0, 0.3, 0.0]])
    np.testing.assert_allclose(
        transform_points(T, ahead_right_below), [[1, 4, 0.3], [2, 2, 0.3], [1, 2, 0]], atol=1e-12
    )
