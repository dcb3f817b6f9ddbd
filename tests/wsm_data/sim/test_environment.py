import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.planners.planner import GoalFrame, Plan, Sense
from wsm_data.sim.config import SimConfig
from wsm_data.sim.environment import Environment
from wsm_data.sim.episodes import Episode
from wsm_data.sim.rules import Ending

AHEAD = Plan(path_m=np.column_stack([0.1 * np.arange(1, 25), np.zeros(24)]))
ALL = frozenset(Sense)


def episode(start=(1.0, 1.5, 0.0), goal=(7.0, 1.5)):
    return Episode(start_pose=np.array(start), goal_xy_m=np.array(goal))


def test_a_planner_is_given_what_it_declares_and_nothing_else(rooms, config):
    environment = Environment(rooms, 0, episode(), config)
    for senses in (frozenset({Sense.RGB}), frozenset({Sense.DEPTH, Sense.POSE}), frozenset({Sense.MAP}), frozenset()):
        seen = environment.observe(senses)
        given = {
            Sense.RGB: seen.rgb_u8 is not None,
            Sense.DEPTH: seen.depth_m is not None,
            Sense.POSE: seen.pose is not None,
            Sense.MAP: seen.known_map is not None,
        }
        assert {sense for sense, there in given.items() if there} == senses
    assert rooms.rendered == 2  # who sees nothing costs no picture


def test_the_goal_is_given_in_the_frame_of_the_start_or_of_the_moment(rooms, small_camera):
    for frame, wanted in ((GoalFrame.START, (0.0, -6.0)), (GoalFrame.CURRENT, (0.0, -6.0))):
        environment = Environment(
            rooms, 0, episode((1.0, 1.5, np.pi / 2)), SimConfig(intrinsics=small_camera, goal=frame)
        )
        np.testing.assert_allclose(environment.observe(ALL).goal_xy_m, wanted, atol=1e-12)
        environment.follow(AHEAD, 0)
        for _ in range(4):
            environment.advance()
        moved = wanted if frame == GoalFrame.START else (-0.3, -6.0)  # four steps of 0.075 m
        np.testing.assert_allclose(environment.observe(ALL).goal_xy_m, moved, atol=1e-6)


def test_before_the_first_plan_the_robot_stands_still_and_ends_stuck(rooms, config):
    environment = Environment(rooms, 0, episode(), config)
    while environment.ending is None:
        environment.advance()
    rollout = environment.rollout()
    assert rollout.ending == Ending.STUCK
    assert len(rollout.commands) == 30
    assert rollout.driven_m == 0.0


def test_a_wall_stops_the_disc_at_its_radius_and_is_counted(rooms, config):
    environment = Environment(rooms, 0, episode((3.0, 4.0, 0.0)), config)  # the wall between the rooms is 1 m ahead
    environment.follow(AHEAD, 0)
    while environment.ending is None:
        environment.advance()
    rollout = environment.rollout()
    assert rollout.contact.any()
    assert rollout.poses[-1, 0] == pytest.approx(4.0 - 0.25, abs=0.01)
    assert (rollout.clearance_m >= 0.25).all()
    assert rollout.driven_m == pytest.approx(rollout.poses[-1, 0] - 3.0, abs=1e-9)


def test_a_path_is_placed_where_the_robot_was_when_it_was_asked_for(rooms, config):
    environment = Environment(rooms, 0, episode(), config)
    environment.follow(AHEAD, 0)
    for _ in range(5):
        environment.advance()
    late = Plan(path_m=np.column_stack([0.1 * np.arange(1, 25), np.full(24, 0.2)]))
    environment.follow(late, 0)  # an answer to the first observation
    for _ in range(20):
        environment.advance()
    assert environment.observe(ALL).pose[1] == pytest.approx(0.2, abs=0.05)


def test_with_estimated_poses_the_controller_tracks_where_the_planner_believes_to_be(rooms, small_camera):
    config = SimConfig(intrinsics=small_camera, estimated_controller_pose=True)
    environment = Environment(rooms, 0, episode(), config)
    environment.follow(Plan(path_m=AHEAD.path_m, pose_estimate=np.array([5.0, 5.0, 1.0])), 0)
    for _ in range(10):
        environment.advance()
    np.testing.assert_allclose(environment.observe(ALL).pose, (0.75, 0.0, 0.0), atol=1e-3)
    with pytest.raises(ValueError, match="needs a planner that gives its pose"):
        environment.follow(AHEAD, 0)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (episode(start=(0.1, 1.5, 0.0)), Reason.START_BLOCKED),
        (episode(goal=(20.0, 1.5)), Reason.GOAL_UNREACHABLE),
        (episode(start=(20.0, 1.5, 0.0)), Reason.GOAL_UNREACHABLE),
    ],
)
def test_an_impossible_episode_is_refused_by_its_reason(rooms, config, wrong, reason):
    with pytest.raises(DataError) as refusal:
        Environment(rooms, 0, wrong, config)
    assert refusal.value.reason == reason


def test_an_episode_that_goes_on_has_no_rollout(rooms, config):
    with pytest.raises(ValueError, match="has not ended"):
        Environment(rooms, 0, episode(), config).rollout()
