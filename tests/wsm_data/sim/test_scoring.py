import numpy as np
import pytest

from wsm_data.planners.planner import Plan
from wsm_data.sim.config import SimConfig
from wsm_data.sim.episodes import Episode
from wsm_data.sim.result import Answer, Rollout
from wsm_data.sim.rules import Ending
from wsm_data.sim.scoring import score_rollout


def rollout(clearance_m, contact, answers=(), success=True):
    steps = len(contact)
    poses = np.column_stack([np.linspace(0, 4, steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)])
    return Rollout(
        scene="rooms",
        number=3,
        episode=Episode(start_pose=poses[0], goal_xy_m=np.array([4.0, 3.0])),
        ending=Ending.ARRIVED,
        success=success,
        poses=poses,
        commands=np.zeros((steps, 2)),
        clearance_m=np.array(clearance_m),
        contact=np.array(contact, bool),
        driven_m=8.0,
        geodesic_m=6.0,
        answers=tuple(answers),
    )


def score(**fields):
    return score_rollout(rollout(**fields), "oracle", SimConfig())


def test_success_is_weighted_by_either_shortest_way():
    result = score(clearance_m=[1.0] * 3, contact=[0, 0])
    assert (result.spl_geodesic, result.spl_straight) == (6 / 8, 5 / 8)
    assert (result.straight_m, result.driven_m, result.seconds) == (5.0, 8.0, pytest.approx(0.3))
    assert result.navigation_error_m == 3.0
    assert score(clearance_m=[1.0] * 3, contact=[0, 0], success=False).spl_straight == 0.0


def test_a_touch_that_lasts_counts_once_and_is_no_near_miss():
    contact = [0, 0, 1, 1, 1, 0, 0, 1, 0]
    clearance = [1, 0.29, 0.26, 0.25, 0.25, 0.25, 0.27, 1, 0.25, 1]
    result = score(clearance_m=clearance, contact=contact)
    assert (result.collisions, result.near_misses) == (2, 0)


def test_what_came_near_without_being_touched_is_a_near_miss_once_each_time():
    clearance = [1, 0.29, 0.27, 1, 0.299, 0.31, 1, 0.26]
    result = score(clearance_m=clearance, contact=[0] * 7)
    assert (result.collisions, result.near_misses) == (0, 3)


def test_a_planner_without_estimates_has_no_errors_of_them():
    result = score(
        clearance_m=[1.0] * 3,
        contact=[0, 0],
        answers=[Answer(step=0, pose=np.zeros(3), plan=Plan(path_m=np.zeros((2, 2))))],
    )
    assert (result.localisation_error_m, result.ate_rmse_unaligned_m, result.plans) == (None, None, 1)


def test_the_planner_s_own_goal_and_poses_are_compared_with_the_true_ones():
    pose = np.array([1.0, 0.0, np.pi / 2])
    plan = Plan(
        path_m=np.zeros((2, 2)), goal_estimate_m=np.array([3.0, -3.4, 9.0]), pose_estimate=np.array([1.0, 0.3, 0])
    )
    result = score(clearance_m=[1.0] * 3, contact=[0, 0], answers=[Answer(step=1, pose=pose, plan=plan)])
    assert result.localisation_error_m == pytest.approx(0.4)  # the goal is at (3, -3) there
    assert result.ate_rmse_unaligned_m == pytest.approx(0.3)
