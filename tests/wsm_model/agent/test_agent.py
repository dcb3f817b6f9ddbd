"""The agent with random weights: what reaches it, when it answers, what it remembers."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from wsm_data.errors import DataError
from wsm_data.planners.planner import GoalFrame, Sense
from wsm_model.agent.config import AgentConfig
from wsm_model.config import Variant
from wsm_model.inference.session import SessionConfig

STEPS = 9  # three latents


class RgbAlone:
    """An observation that cannot be asked for anything but its pictures, the goal and the step."""

    def __init__(self, observation):
        self._observation = observation

    def __getattr__(self, name):
        if name not in {"step", "goal_xy_m", "goal_frame", "rgb_u8"}:
            raise AssertionError(f"the agent asked for {name}")
        return getattr(self._observation, name)


def drive(agent, camera, observe, steps=STEPS, environment=0, **goal):
    agent.reset(camera, 1)
    return [agent.plan({0: observe(step, environment, **goal)})[0] for step in range(steps)]


def paths(plans):
    return [plan.candidates_m[0] for plan in plans if plan is not None]


def test_nothing_but_pictures_and_the_goal_reaches_the_agent(make_agent, camera, observe):
    agent = make_agent()
    assert agent.senses == frozenset({Sense.RGB})
    agent.reset(camera, 1)
    plans = [agent.plan({0: RgbAlone(observe(step))})[0] for step in range(STEPS)]
    assert len(paths(plans)) == 3


def test_it_answers_to_the_first_frame_and_then_to_every_fourth(make_agent, camera, observe):
    assert [plan is not None for plan in drive(make_agent(), camera, observe)] == [True, *([False] * 3 + [True]) * 2]


def test_frames_between_those_that_count_are_not_looked_at(make_agent, camera, observe):
    agent = make_agent(AgentConfig(steps_per_frame=2))
    assert [step for step, plan in enumerate(drive(agent, camera, observe, 18)) if plan is not None] == [0, 8, 16]


def test_the_same_seed_gives_the_same_paths_and_another_one_others(make_agent, camera, observe):
    first, again = (paths(drive(make_agent(), camera, observe)) for _ in range(2))
    other = paths(drive(make_agent(AgentConfig(seed=1)), camera, observe))
    assert all(np.array_equal(*pair) for pair in zip(first, again, strict=True))
    assert not np.allclose(first[0], other[0])


def test_environments_together_are_each_as_if_alone(make_agent, camera, observe):
    """But for the rounding of float32; the second one begins three steps later."""
    alone = [paths(drive(make_agent(), camera, observe, environment=number)) for number in range(2)]
    agent, together = make_agent(), ([], [])
    agent.reset(camera, 2)
    for step in range(STEPS + 3):
        shown = {0: observe(step)} if step < STEPS else {}
        if step >= 3:
            shown[1] = observe(step - 3, 1)
        for number, plan in agent.plan(shown).items():
            together[number].append(plan)
    for number in range(2):
        for found, wanted in zip(paths(together[number]), alone[number], strict=True):
            assert found == pytest.approx(wanted, abs=1e-4)


def test_a_reset_environment_remembers_nothing(make_agent, camera, observe):
    agent = make_agent()
    wanted = paths(drive(agent, camera, observe))
    agent.reset_environment(0)
    found = paths([agent.plan({0: observe(step)})[0] for step in range(STEPS)])
    assert all(np.array_equal(*pair) for pair in zip(found, wanted, strict=True))


def test_dreams_leave_nothing_in_the_history_and_the_anchor_outlives_the_others(make_agent, camera, observe):
    """Four latents fit: after five seen latents the anchor and the newest three are held, and one was dropped."""
    agent = make_agent(AgentConfig(session=SessionConfig(chunk_size=2, cache_latents=4)))
    drive(agent, camera, observe, 1)
    history = agent._drives[0].episode.history
    anchor = history.read(0, 1, 1).keys.clone()
    assert history.rgb.held == 1
    for step in range(1, 17):
        agent.plan({0: observe(step)})
    for places in (history.rgb, history.state):
        assert (sorted(places.numbers), places.next) == ([0, 2, 3, 4], 5)
    assert torch.equal(history.read(0, 1, 1).keys, anchor)


def test_it_begins_at_exactly_the_identity(make_agent, camera, observe):
    first = drive(make_agent(), camera, observe, 1)[0]
    assert first.pose_estimate.tolist() == [0.0, 0.0, 0.0]
    assert first.goal_estimate_m.tolist() == [3.0, 1.0, 0.0]


def test_a_goal_in_the_start_frame_is_taken_once_and_an_oracle_goal_anew(make_agent, camera, observe):
    def second_goal(frame):
        agent = make_agent()
        agent.reset(camera, 1)
        agent.plan({0: observe(0, frame=frame)})
        moved = [agent.plan({0: observe(step, goal=(-2.0, 5.0), frame=frame)})[0] for step in range(1, 5)]
        return moved[-1].goal_estimate_m[:2], moved[-1].pose_estimate

    fixed, pose = second_goal(GoalFrame.START)
    assert not np.allclose(fixed, [-2.0, 5.0])
    assert second_goal(GoalFrame.CURRENT)[0] == pytest.approx([-2.0, 5.0], abs=1e-5)
    assert not np.allclose(pose, 0.0)


def test_a_dream_that_hardly_moves_is_the_wish_to_stand(make_agent, camera, observe):
    assert not drive(make_agent(AgentConfig(standing_m=1e6)), camera, observe, 1)[0].path_m.any()
    assert drive(make_agent(AgentConfig(standing_m=0.0)), camera, observe, 1)[0].path_m.any()


def test_no_more_than_the_poses_that_are_executed_is_answered(make_agent, camera, observe):
    plan = drive(make_agent(AgentConfig(turn_rad=4.0)), camera, observe, 1)[0]
    assert plan.candidates_m.shape == (1, 16, 2)
    assert np.array_equal(plan.path_m[1:], plan.candidates_m[0, :4])


def test_a_watcher_sees_the_pictures_of_each_dream(make_agent, camera, observe):
    shown = []
    agent = make_agent(watcher=lambda number, observation, pictures: shown.append((observation.step, pictures.shape)))
    drive(agent, camera, observe)
    assert shown == [(step, (16, 64, 96, 3)) for step in (0, 4, 8)]


def test_without_slam_it_takes_the_poses_that_it_answered_with(make_agent, make_model, camera, observe):
    agent = make_agent(of=make_model(Variant.IDM, latent_channels=48).eval())
    first, second = (plan for plan in drive(agent, camera, observe, 5) if plan is not None)
    assert second.pose_estimate[:2] == pytest.approx(first.candidates_m[0, 3])


def test_a_frame_of_another_size_is_refused(make_agent, camera, observe):
    agent = make_agent()
    agent.reset(replace(camera, width=256), 1)
    with pytest.raises(DataError, match="256x72 px"):
        agent.plan({0: observe(0)})
