from dataclasses import replace

import numpy as np
import pytest

from wsm_data.geometry.planar import points_in_base
from wsm_data.planners.depth_scan import ScanConfig
from wsm_data.planners.map_and_plan import MapAndPlan, estimated_pose, true_pose
from wsm_data.planners.planner import GoalFrame, Observation


def observe(depth_m, goal, pose=(0.0, 0.0, 0.0), step=0):
    return Observation(
        step=step, goal_xy_m=np.array(goal), goal_frame=GoalFrame.START, depth_m=depth_m, pose=np.array(pose)
    )


def test_it_remembers_a_wall_that_it_no_longer_sees(camera, look_at):
    fresh, knowing = (MapAndPlan(camera, 0.25, ScanConfig(), true_pose) for _ in range(2))
    goal, heading = (3.0, 0.5), 0.35
    knowing.plan(observe(look_at(1.2, (-0.3, 50.0)), goal))
    aside = observe(look_at(6.0), goal, (0.0, 0.0, heading), step=1)
    straight, around = fresh.plan(aside).path_m, knowing.plan(aside).path_m
    assert straight[0, 0] > 0  # the goal lies ahead
    assert (around[:, 0] == 0).all()  # the way past the wall does not


def test_it_says_where_it_believes_to_be_and_where_the_goal_is(camera, look_at):
    planner = MapAndPlan(camera, 0.25, ScanConfig(), true_pose)
    plan = planner.plan(observe(look_at(4.0), (3.0, 0.0), (1.0, 0.0, np.pi / 2)))
    np.testing.assert_allclose(plan.pose_estimate, (1.0, 0.0, np.pi / 2))
    np.testing.assert_allclose(plan.goal_estimate_m, (0.0, -2.0, 0.0), atol=1e-12)


def test_estimating_its_pose_it_needs_none(camera, look_at):
    planner = MapAndPlan(camera, 0.25, ScanConfig(), estimated_pose())
    unaided = Observation(step=0, goal_xy_m=np.array([3.0, 0.0]), goal_frame=GoalFrame.START, depth_m=look_at(4.0))
    assert (planner.plan(unaided).pose_estimate == 0).all()
    with pytest.raises(ValueError, match="needs the pose"):
        MapAndPlan(camera, 0.25, ScanConfig(), true_pose).plan(unaided)


def test_a_goal_that_is_given_anew_is_the_same_goal_where_the_pose_puts_it(camera, look_at):
    pose = np.array([1.0, 0.5, 0.3])
    fixed = observe(look_at(4.0), (3.0, 0.5), pose)
    anew = replace(fixed, goal_xy_m=points_in_base(fixed.goal_xy_m[None], pose)[0], goal_frame=GoalFrame.CURRENT)
    plans = [MapAndPlan(camera, 0.25, ScanConfig(), true_pose).plan(one) for one in (fixed, anew)]
    np.testing.assert_allclose(plans[1].path_m, plans[0].path_m, atol=1e-9)
    np.testing.assert_allclose(plans[1].goal_estimate_m[:2], anew.goal_xy_m, atol=1e-9)
