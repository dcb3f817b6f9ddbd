"""A planner that remembers what it was asked, and pictures of a few pixels."""

import numpy as np
import pytest

from wsm_data.planners.planner import GoalFrame, Observation, Plan, Sense
from wsm_data.schema.camera import Intrinsics


class RecordingPlanner:
    """Answers with a straight path of `step + 2` points; remembers everything it is given."""

    name = "recording"

    def __init__(self, senses=frozenset({Sense.RGB, Sense.DEPTH})):
        self.senses = senses
        self.resets = []
        self.seen = []
        self.answers = None

    def reset(self, intrinsics, environments):
        self.resets.append((intrinsics, environments))

    def reset_environment(self, environment):
        self.resets.append(environment)

    def plan(self, observations):
        self.seen.append(observations)
        if self.answers is not None:
            return {number: self.answers(number, one) for number, one in observations.items()}
        return {
            number: Plan(
                path_m=np.linspace([0.0, 0.0], one.goal_xy_m, one.step + 2), goal_estimate_m=np.append(one.goal_xy_m, 0)
            )
            for number, one in observations.items()
        }


@pytest.fixture
def recording():
    return RecordingPlanner()


@pytest.fixture
def make_recording():
    return RecordingPlanner


@pytest.fixture(scope="session")
def small_camera():
    return Intrinsics(fx=30.0, fy=30.0, cx=16.0, cy=8.0, width=32, height=16)


@pytest.fixture(scope="session")
def red_left():
    """Pictures [B, 16, 32, 3]: the left half red, the right half a blue that grows with the environment."""

    def make(batch):
        rgb = np.zeros((batch, 16, 32, 3), np.uint8)
        rgb[:, :, :16, 0] = 250
        rgb[:, :, 16:, 2] = 60 * np.arange(1, batch + 1)[:, None, None]
        return rgb

    return make


@pytest.fixture(scope="session")
def observe(red_left):
    def make(number=0, goal=(3.0, -1.0), depth_m=2.0):
        return Observation(
            step=0,
            goal_xy_m=np.array(goal),
            goal_frame=GoalFrame.CURRENT,
            rgb_u8=red_left(number + 1)[number],
            depth_m=np.full((16, 32), depth_m, np.float32),
        )

    return make
