"""Right, down and forward of a camera become forward and left of its base; numbers are worked out by hand."""

import numpy as np
import pytest

from wsm_data.geometry.planar import camera_over, relative_to
from wsm_data.geometry.transform import invert
from wsm_model.agent.floor import floor_points, floor_pose, followed_path, goal_camera0_m, path_in_base

START, HERE = np.array([1.0, 2.0, 0.4]), np.array([3.0, 1.0, -0.9])


def test_ahead_is_z_and_left_is_minus_x():
    assert floor_points(np.array([[1.0, 5.0, 2.0]])).tolist() == [[2.0, -1.0]]
    assert goal_camera0_m(np.array([2.0, 1.0]), np.eye(4)).tolist() == [-1.0, 0.0, 2.0]


def test_poses_of_level_cameras_are_the_planar_poses_of_their_bases():
    T_start_here = invert(camera_over(START, 0.3)) @ camera_over(HERE, 0.3)
    assert floor_pose(T_start_here) == pytest.approx(relative_to(HERE, START))


def test_a_path_is_seen_from_where_the_camera_is():
    T_start_here = invert(camera_over(START, 0.3)) @ camera_over(HERE, 0.3)
    ahead = np.array([HERE[0] + 2 * np.cos(HERE[2]), HERE[1] + 2 * np.sin(HERE[2]), 0.0])
    T_start_ahead = invert(camera_over(START, 0.3)) @ camera_over(ahead, 0.3)
    assert path_in_base(T_start_here, T_start_ahead[None])[0] == pytest.approx([2.0, 0.0])


def test_a_goal_that_is_given_anew_is_brought_to_the_first_camera():
    T_start_here = invert(camera_over(START, 0.3)) @ camera_over(HERE, 0.3)
    found = goal_camera0_m(np.array([2.0, 0.0]), T_start_here)
    wanted = relative_to(np.array([HERE[0] + 2 * np.cos(HERE[2]), HERE[1] + 2 * np.sin(HERE[2]), 0.0]), START)
    assert floor_points(found[None])[0] == pytest.approx(wanted[:2])
    assert found[1] == pytest.approx(0.0)


def test_a_path_ahead_is_followed_from_the_robot_on():
    assert followed_path(np.array([[0.1, 0.0], [0.2, 0.1]]), 1.3).tolist() == [[0.0, 0.0], [0.1, 0.0], [0.2, 0.1]]


@pytest.mark.parametrize(("end", "side"), [((-0.2, 0.1), 1.0), ((-0.2, -0.1), -1.0), ((0.01, 0.2), 1.0)])
def test_a_path_that_the_controller_would_not_follow_is_answered_with_a_turn(end, side):
    assert followed_path(np.array([[0.0, 0.0], end]), 1.3).tolist() == [[0.0, side]] * 3
