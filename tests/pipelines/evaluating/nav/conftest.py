"""An empty room in place of generated homes: it is there at once."""

import numpy as np
import pytest

from pipelines.evaluating.nav import drive
from pipelines.evaluating.nav.config import NavConfig
from wsm_data.planners.planner import GoalFrame
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.sim.config import SimConfig

SIDES_M = np.array([8.0, 5.0])
CAMERA = Intrinsics(fx=20.0, fy=20.0, cx=15.5, cy=8.5, width=32, height=18)


class Room:
    """8 x 5 m within walls; its pictures are grey."""

    def __init__(self, scene):
        self.scene = scene
        cells = np.ones((104, 164), np.uint8)
        cells[2:-2, 2:-2] = 0
        self.grid = OccupancyGrid(cells=cells, origin_cell=(-2, -2), resolution_m=0.05)

    def render(self, T_world_camera):
        return np.full((18, 32, 3), 128, np.uint8), np.full((18, 32), 2.0, np.float32)

    def clearance_m(self, xy_m):
        return np.minimum(xy_m, SIDES_M - xy_m).min(axis=1)


@pytest.fixture
def opened(monkeypatch):
    """Names of the scenes that were opened."""
    names = []

    def open_room(scene, config):
        names.append(scene.name)
        return Room(scene.name)

    monkeypatch.setattr(drive, "open_world", open_room)
    return names


@pytest.fixture
def make_config():
    def make(planner="straight-line", goal=GoalFrame.START, **changes):
        sim = SimConfig(intrinsics=CAMERA, goal=goal, protocol="navdp-2025-12")
        return NavConfig(**{"planner": planner, "sim": sim, "episodes_per_scene": 2, "seed": 7} | changes)

    return make
