"""An agent with a small random model on the built-in codec, and a camera of 96 x 64 px."""

import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.planners.planner import GoalFrame, Observation
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.agent.agent import Agent
from wsm_model.agent.config import AgentConfig
from wsm_model.agent.eye import Eye

CHANNELS = 48


@pytest.fixture
def camera():
    return Intrinsics(fx=70.0, fy=70.0, cx=63.5, cy=35.5, width=128, height=72)


@pytest.fixture
def standard():
    numbers = np.linspace(0.5, 2.0, CHANNELS).tolist()
    return LatentStandard(
        codec="dct",
        codec_digest=DctCodec().describe().digest,
        rgb_mean=tuple(numbers),
        rgb_std=tuple(reversed(numbers)),
        depth_mean=tuple(numbers),
        depth_std=tuple(numbers),
    )


@pytest.fixture
def model(make_model):
    return make_model(latent_channels=CHANNELS).eval()


@pytest.fixture
def make_agent(model, standard):
    def make(config=None, watcher=None, of=None):
        chosen = of or model
        return Agent(chosen, Eye(DctCodec(), standard, chosen.config), config or AgentConfig(), watcher)

    return make


@pytest.fixture
def observe(camera):
    """The observation of a step; pictures are random, by the environment's number and the step."""

    def make(step, environment=0, goal=(3.0, 1.0), frame=GoalFrame.START):
        rng = np.random.default_rng([environment, step])
        rgb_u8 = rng.integers(0, 256, (camera.height, camera.width, 3), dtype=np.uint8)
        return Observation(step=step, goal_xy_m=np.array(goal), goal_frame=frame, rgb_u8=rgb_u8)

    return make
