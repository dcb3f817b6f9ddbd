"""Queries on an open floor, with random histories."""

import numpy as np
import pytest
import torch

from wsm_data.maps.reward_map import RewardMap
from wsm_data.schema.occupancy import FREE, OccupancyGrid
from wsm_model.posttraining.rollout import Query


@pytest.fixture
def floor():
    """10 m by 10 m around the origin, with the goal at x = 4 m; D is the distance along x."""
    cells = np.full((200, 200), FREE, np.uint8)
    x_m = (np.arange(200) - 99.5) * 0.05
    field = np.broadcast_to(np.rint(np.abs(4.0 - x_m) * 1000), (200, 200)).astype(np.uint16)
    grid = OccupancyGrid(cells=cells, origin_cell=(-100, -100), resolution_m=0.05)
    return RewardMap(grid=grid, geodesic_mm=field, robot_radius_m=0.25)


@pytest.fixture
def make_query(floor, config):
    """Builds query `number`: a history of `latents` and an expert that goes 3 cm a frame."""

    def make(number=0, latents=3, future=2):
        generator = torch.Generator().manual_seed(number)
        shape = (latents, config.latent_channels, config.latent_height, config.latent_width)
        rng = np.random.default_rng(number)
        return Query(
            key=f"a/home/{number:06d}",
            scene=f"home_{number}",
            replan_latent=latents - 1,
            rgb=torch.randn(shape, generator=generator),
            goal_camera0_m=torch.tensor([0.0, 0.0, 4.0]),
            T_world_camera=np.eye(4),
            true_m=np.cumsum(rng.normal(size=(4 * latents, 3)), axis=0),
            expert_distance_m=4.0 - 0.03 * np.arange(4 * future + 1),
            reward_map=floor,
        )

    return make
