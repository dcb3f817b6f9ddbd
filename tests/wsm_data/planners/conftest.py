"""A small floor plan with one door, and a camera of a few pixels that looks at a wall."""

import numpy as np
import pytest

from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import OccupancyGrid


@pytest.fixture(scope="session")
def two_rooms():
    """6 m x 4 m, a wall at x = 3 m with a door of 1 m at y in [1, 2); rows are y."""
    cells = np.zeros((80, 120), np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 1
    cells[:, 60] = 1
    cells[20:40, 60] = 0
    return OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)


@pytest.fixture(scope="session")
def camera():
    return Intrinsics(fx=119.15, fy=119.15, cx=79.5, cy=44.5, width=160, height=90)


@pytest.fixture(scope="session")
def look_at(camera):
    """Depth that the level camera sees at 0.3 m above a floor, with a wall across x = `wall_m` and y in `span_m`."""

    def make(wall_m, span_m=(-50.0, 50.0)):
        v, u = np.mgrid[: camera.height, : camera.width].astype(float)
        floor = np.where(v > camera.cy, 0.3 * camera.fy / np.maximum(v - camera.cy, 1e-9), np.inf)
        y = -(u - camera.cx) / camera.fx * wall_m
        wall = np.where((y >= span_m[0]) & (y <= span_m[1]), wall_m, np.inf)
        depth = np.minimum(floor, wall)
        return np.where(np.isfinite(depth), depth, 0.0).astype(np.float32)

    return make
