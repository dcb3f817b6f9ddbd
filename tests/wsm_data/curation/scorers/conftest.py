"""Trajectories on small drawn maps, and rigid motions of whole scenes."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from wsm_data.curation.scorers.clip_images import ClipImages
from wsm_data.curation.scorers.trajectory import Trajectory, map_with
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

RESOLUTION_M = 0.05
CAMERA = Intrinsics(fx=237.2, fy=250.1, cx=150.0, cy=95.5, width=320, height=192)


def along(waypoints, step_m: float) -> np.ndarray:
    """Positions about `step_m` apart on straight lines between waypoints; float64 [N, 2]."""
    points = [np.array(waypoints[:1], float)]
    for start, end in pairwise(waypoints):
        count = max(1, round(float(np.hypot(*np.subtract(end, start))) / step_m))
        points.append(np.linspace(start, end, count + 1)[1:])
    return np.concatenate(points)


def cameras(path_xy_m: np.ndarray, heading_rad: np.ndarray, pitch_rad: float = 0.2) -> np.ndarray:
    """OpenCV cameras at a height of 0.6 m that look along headings and down by a pitch; float64 [N, 4, 4]."""
    c, s, down, level = np.cos(heading_rad), np.sin(heading_rad), np.sin(pitch_rad), np.cos(pitch_rad)
    T = np.zeros((len(path_xy_m), 4, 4))
    T[:, 0, 0], T[:, 1, 0] = s, -c
    T[:, :3, 1] = np.column_stack([-c * down, -s * down, np.full(len(c), -level)])
    T[:, :3, 2] = np.column_stack([c * level, s * level, np.full(len(c), -down)])
    T[:, :2, 3], T[:, 2, 3], T[:, 3, 3] = path_xy_m, 0.6, 1.0
    return T


def headings_along(path_xy_m: np.ndarray) -> np.ndarray:
    if len(path_xy_m) == 1:
        return np.zeros(1)
    steps = np.diff(path_xy_m, axis=0)
    steps = np.concatenate([steps, steps[-1:]])
    return np.arctan2(steps[:, 1], steps[:, 0])


def floor_of(width_m: float, height_m: float, things=()) -> OccupancyGrid:
    """A room with walls of a cell around it, its clear inside from (0, 0); things are (x0, y0, x1, y1) in m."""
    columns, rows = round(width_m / RESOLUTION_M), round(height_m / RESOLUTION_M)
    cells = np.full((rows + 2, columns + 2), OCCUPIED, np.uint8)
    cells[1:-1, 1:-1] = FREE
    for thing in things:
        x0, y0, x1, y1 = (round(edge / RESOLUTION_M) + 1 for edge in thing[:4])
        cells[y0:y1, x0:x1] = thing[4] if len(thing) > 4 else OCCUPIED
    return OccupancyGrid(cells=cells, origin_cell=(-1, -1), resolution_m=RESOLUTION_M)


@pytest.fixture
def floor() -> Callable[..., OccupancyGrid]:
    """`floor_of`."""
    return floor_of


@pytest.fixture
def drive() -> Callable[..., Trajectory]:
    """Makes a trajectory along straight lines between waypoints, looking where it goes unless headings are given."""

    def make(grid, waypoints, *, step_m=0.04, heading_rad=None, goal_xy_m=None, start_distance_m=None):
        path = along(waypoints, step_m)
        goal = np.array(path[-1] if goal_xy_m is None else goal_xy_m, float)
        straight = float(np.hypot(*(path[0] - goal)))
        heading = headings_along(path) if heading_rad is None else np.broadcast_to(heading_rad, len(path))
        return Trajectory(
            T_world_camera=cameras(path, heading),
            intrinsics=CAMERA,
            goal_xy_m=goal,
            goal_radius_m=0.2,
            start_distance_m=max(0.0, straight - 0.2) if start_distance_m is None else start_distance_m,
            map=map_with(grid, np.concatenate([path, goal[None]])),
            robot_radius_m=0.25,
        )

    return make


@pytest.fixture
def moved() -> Callable[..., Trajectory]:
    """Moves a whole scene: by whole cells, and by quarter turns to the left of map, poses and goal together."""

    def move(trajectory: Trajectory, *, cells=(0, 0), quarters=0) -> Trajectory:
        grid, r = trajectory.map, trajectory.map.resolution_m
        x0, y0 = grid.origin_cell
        turned = np.ascontiguousarray(np.rot90(grid.cells, -quarters))  # rows are y: to the left is against rot90
        corners = np.array([[x0, y0], [x0 + grid.cells.shape[1], y0 + grid.cells.shape[0]]])
        R = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), quarters % 4)
        low = (corners @ R.T).min(axis=0)
        T_new_old = np.eye(4)
        T_new_old[:2, :2] = R
        T_new_old[:2, 3] = np.array(cells) * r
        return replace(
            trajectory,
            T_world_camera=T_new_old @ trajectory.T_world_camera,
            goal_xy_m=R @ trajectory.goal_xy_m + np.array(cells) * r,
            map=OccupancyGrid(
                cells=turned, origin_cell=(int(low[0]) + cells[0], int(low[1]) + cells[1]), resolution_m=r
            ),
        )

    return move


@pytest.fixture
def home(drive) -> Trajectory:
    """A way with a turn through a door between two furnished rooms, in part unknown; nothing is on a cell's border."""
    things = [
        (3.0, 0.0, 3.1, 1.0),
        (3.0, 1.8, 3.1, 4.0),
        (1.0, 2.6, 1.8, 3.2),
        (4.3, 0.3, 4.6, 0.9),
        (2.0, 0.2, 2.3, 0.5),
        (0.0, 3.0, 0.6, 4.0, UNKNOWN),
        (5.0, 0.0, 6.0, 0.7, UNKNOWN),
    ]
    path = [(0.617, 0.713), (1.913, 1.377), (3.907, 1.391), (4.711, 3.313)]
    return drive(floor_of(6.0, 4.0, things), path, start_distance_m=5.2)


@pytest.fixture
def make_images() -> Callable[..., ClipImages]:
    """Images of latents of 48 channels and 2 x 3 cells, with arrays that may be given."""

    def make(*, latents=4, **changes: object) -> ClipImages:
        values = {
            "rgb_latent": np.random.default_rng(0).normal(size=(latents, 48, 2, 3)).astype(np.float16),
            "rgb_std": np.ones(48),
            "depth_valid": np.full((latents, 2, 3), 255, np.uint8),
            "sampled": np.empty(0, np.int64),
            "sampled_depth": np.empty((0, 32, 48), np.float32),
        }
        return ClipImages(**(values | changes))

    return make


@pytest.fixture(scope="session")
def drive_for_given() -> Callable[[np.ndarray, np.ndarray], Trajectory]:
    """A trajectory along the x axis with given headings, for tests that hypothesis calls many times."""

    def make(x_m: np.ndarray, heading_rad: np.ndarray) -> Trajectory:
        path = np.column_stack([x_m + 0.5, np.full(len(x_m), 1.0)])
        return Trajectory(
            T_world_camera=cameras(path, heading_rad),
            intrinsics=CAMERA,
            goal_xy_m=path[-1],
            goal_radius_m=0.2,
            start_distance_m=float(x_m[-1]),
            map=map_with(floor_of(1.0, 1.0), path),
            robot_radius_m=0.25,
        )

    return make
