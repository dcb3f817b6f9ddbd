"""The loop with built-in planners in a world of two rooms."""

import numpy as np
import pytest

from wsm_data.planners.planner import Plan, Sense
from wsm_data.planners.registry import PlannerConfig, make_planner
from wsm_data.sim.config import SimConfig
from wsm_data.sim.environment import Environment
from wsm_data.sim.episodes import Episode, make_episodes
from wsm_data.sim.loop import run_episodes
from wsm_data.sim.rules import Ending


class Scripted:
    """Keeps what it was asked, and answers with a path ahead, or with None after the first time."""

    name, senses = "scripted", frozenset({Sense.POSE})

    def __init__(self, once=False):
        self.once, self.asked, self.resets = once, [], []

    def reset(self, intrinsics, environments):
        self.environments = environments

    def reset_environment(self, environment):
        self.resets.append(environment)

    def plan(self, observations):
        self.asked.append({slot: one.step for slot, one in observations.items()})
        path = np.column_stack([0.1 * np.arange(1, 25), np.zeros(24)])
        return {slot: None if self.once and one.step > 0 else Plan(path_m=path) for slot, one in observations.items()}


def drive(planner, rooms, config, episodes, environments=1):
    ready = (Environment(rooms, number, one, config) for number, one in enumerate(episodes))
    return list(run_episodes(planner, ready, config, environments))


TO_THE_WALL = Episode(start_pose=np.array([2.0, 3.5, 0.0]), goal_xy_m=np.array([7.0, 3.5]))


@pytest.mark.parametrize("latency", [0, 1, 3])
def test_an_answer_is_followed_as_many_steps_later_as_the_latency_says(rooms, small_camera, latency):
    config, planner = SimConfig(intrinsics=small_camera, latency_steps=latency), Scripted()
    (rollout,) = drive(planner, rooms, config, [TO_THE_WALL])
    moved = np.flatnonzero(rollout.commands[:, 0] > 0)
    assert moved[0] == latency
    every = max(latency, 1)
    assert [asked[0] for asked in planner.asked[:4]] == [0, every, 2 * every, 3 * every]
    assert [one.step for one in rollout.answers[:3]] == [0, every, 2 * every]


def test_an_answer_of_none_keeps_the_path_that_is_followed(rooms, config):
    (rollout,) = drive(Scripted(once=True), rooms, config, [TO_THE_WALL])
    assert len(rollout.answers) == 1
    assert rollout.poses[-1, 0] == pytest.approx(3.75, abs=0.01)  # 1.75 m along the path of 2.4 m stands the wall


def test_the_oracle_arrives_through_the_door_and_the_straight_line_ends_at_the_wall(rooms, config):
    episodes = make_episodes(rooms.grid, 6, 0.35, seed=3)
    oracle = drive(make_planner("oracle", PlannerConfig()), rooms, config, episodes, 3)
    assert {one.ending for one in oracle} == {Ending.ARRIVED}
    assert not any(one.contact.any() for one in oracle)
    assert rooms.rendered == 0
    straight = drive(make_planner("straight-line", PlannerConfig()), rooms, config, [TO_THE_WALL])
    assert straight[0].ending == Ending.STUCK


def test_every_episode_is_driven_once_and_alike_however_many_run_side_by_side(rooms, config):
    episodes = make_episodes(rooms.grid, 5, 0.35, seed=4)
    alone, beside = (drive(make_planner("oracle", PlannerConfig()), rooms, config, episodes, count) for count in (1, 3))
    assert [one.number for one in alone] == [0, 1, 2, 3, 4]
    for one in beside:
        assert (one.poses == alone[one.number].poses).all()
    assert sorted(one.number for one in beside) == [0, 1, 2, 3, 4]


def test_each_new_episode_resets_its_environment(rooms, config):
    planner = Scripted()
    drive(planner, rooms, config, [TO_THE_WALL] * 3, 2)
    assert planner.environments == 2
    assert sorted(planner.resets) == [0, 0, 1] or sorted(planner.resets) == [0, 1, 1]
    assert planner.asked[0] == {0: 0, 1: 0}
