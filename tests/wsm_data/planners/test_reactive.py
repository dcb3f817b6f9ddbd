import numpy as np
import pytest

from wsm_data.planners.depth_scan import ScanConfig
from wsm_data.planners.planner import GoalFrame, Observation
from wsm_data.planners.reactive import Reactive, free_lengths


def observe(depth_m, goal):
    return Observation(step=0, goal_xy_m=np.array(goal), goal_frame=GoalFrame.CURRENT, depth_m=depth_m)


@pytest.fixture
def planner(camera):
    return Reactive(camera, 0.25, ScanConfig())


def test_with_nothing_in_the_way_it_goes_straight_to_the_goal(planner, look_at):
    path = planner.plan(observe(look_at(8.0), (2.0, 0.0))).path_m
    np.testing.assert_allclose(path[-1], (2.0, 0.0), atol=0.1)


@pytest.mark.parametrize(("span_m", "side"), [((-0.2, 50.0), -1), ((-50.0, 0.2), 1)])
def test_it_passes_a_wall_on_its_free_side(planner, look_at, span_m, side):
    plan = planner.plan(observe(look_at(1.2, span_m), (4.0, 0.0)))
    best = plan.candidates_m[np.argmax(plan.values)]
    assert side * best[-1, 1] > 0.4


def test_before_a_wall_it_turns(planner, look_at):
    path = planner.plan(observe(look_at(0.5), (4.0, 0.5))).path_m
    assert (path == (0.0, 1.0)).all()


def test_to_a_goal_outside_the_view_it_turns(planner, look_at):
    assert (planner.plan(observe(look_at(4.0), (-1.0, -3.0))).path_m == (0.0, -1.0)).all()


def test_free_lengths_are_those_of_a_disc_pushed_along_each_bearing():
    rng = np.random.default_rng(0)
    points, bearings = rng.uniform(-2, 2, (40, 2)) + np.array([2.5, 0.0]), np.linspace(-0.6, 0.6, 7)
    found = free_lengths(points, bearings, 0.3, 2.5)
    for bearing, length in zip(bearings, found, strict=True):
        steps = np.arange(0, 2.5, 0.002)
        places = steps[:, None] * np.array([np.cos(bearing), np.sin(bearing)])
        touching = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1) < 0.3
        slow = steps[np.argmax(touching)] if touching.any() else 2.5
        assert length == pytest.approx(slow, abs=0.004)


def test_without_depth_it_refuses(planner):
    with pytest.raises(ValueError, match="needs depth"):
        planner.plan(observe(None, (1.0, 0.0)))
