"""A world of two empty rooms with a door between them, made of flat walls."""

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.sim.config import SimConfig
from wsm_data.sim.outlines import mesh_outlines

WALLS = [
    ((0, 0), (8, 0)), ((8, 0), (8, 5)), ((8, 5), (0, 5)), ((0, 5), (0, 0)), ((4, 0), (4, 1)), ((4, 2.2), (4, 5)),
]  # fmt: skip


class Rooms:
    """Its pictures are grey, and see 2 m in every direction."""

    scene = "rooms"

    def __init__(self, intrinsics):
        self.intrinsics = intrinsics
        self.rendered = 0
        walls = [[(*a, 0.0), (*b, 0.0), (*b, 2.5)] for a, b in WALLS] + [
            [(*a, 0.0), (*b, 2.5), (*a, 2.5)] for a, b in WALLS
        ]
        self.outlines = mesh_outlines(np.array(walls, float), 0.15, 0.3)
        row, column = np.mgrid[-2:102, -2:162]
        centres = (np.stack([column.ravel(), row.ravel()], axis=1) + 0.5) * 0.05
        occupied = (self.outlines.clearance_m(centres, 1.0) < 0.03).reshape(row.shape)
        self.grid = OccupancyGrid(cells=occupied.astype(np.uint8), origin_cell=(-2, -2), resolution_m=0.05)

    def render(self, T_world_camera):
        self.rendered += 1
        size = (self.intrinsics.height, self.intrinsics.width)
        return np.full((*size, 3), 128, np.uint8), np.full(size, 2.0, np.float32)

    def clearance_m(self, xy_m):
        return self.outlines.clearance_m(xy_m, 0.75)


@pytest.fixture(scope="session")
def small_camera():
    return Intrinsics(fx=20.0, fy=20.0, cx=15.5, cy=8.5, width=32, height=18)


@pytest.fixture
def rooms(small_camera):
    return Rooms(small_camera)


@pytest.fixture
def config(small_camera):
    return SimConfig(intrinsics=small_camera)
