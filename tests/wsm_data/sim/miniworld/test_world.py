"""Scenes of MiniWorld; skipped where the package or OpenGL without a screen cannot be had."""

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.geometry.camera import unproject
from wsm_data.geometry.planar import camera_over
from wsm_data.geometry.transform import transform_points
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import Robot
from wsm_data.schema.occupancy import FREE, OCCUPIED
from wsm_data.sim.episodes import make_episodes
from wsm_data.sim.miniworld.scenes import KINDS
from wsm_data.sim.miniworld.world import make_miniworld

HEIGHT_M = 0.3
CAMERA = Intrinsics(fx=120.0, fy=115.0, cx=81.0, cy=60.5, width=160, height=120)


@pytest.fixture(scope="module")
def worlds():
    try:
        return [make_miniworld(3, index, Robot(), HEIGHT_M, CAMERA) for index in range(len(KINDS))]
    except ConfigError as error:
        pytest.skip(f"MiniWorld cannot be drawn here: {error}")


def free_places(world, count=4):
    rows, columns = np.nonzero(world.grid.cells == FREE)
    centres = world.grid.cell_centres_xy_m(np.column_stack([columns, rows]).astype(float))
    clear = centres[world.clearance_m(centres) > 0.4]
    return clear[np.linspace(0, len(clear) - 1, count).astype(int)]


def test_depth_is_metric_points_lie_on_the_floor_or_on_what_the_robot_meets(worlds):
    for world in worlds:
        for number, place in enumerate(free_places(world)):
            T = camera_over(np.array([*place, 1.7 * number]), HEIGHT_M)
            depth_m = world.render(T)[1].astype(np.float64)
            points = transform_points(T, unproject(depth_m, CAMERA)[depth_m > 0])
            near = points[np.linalg.norm(points[:, :2] - place, axis=1) < 3]  # a step of depth is 1.4 mm there
            assert near[:, 2].min() > -0.01
            met = near[(near[:, 2] > 0.16) & (near[:, 2] < 0.29)]
            assert world.clearance_m(np.ascontiguousarray(met[:, :2])).max(initial=0) < 0.01


def test_a_scene_is_drawn_as_itself_after_others_were(worlds):
    world = worlds[0]
    T = camera_over(np.array([*free_places(world)[0], 0.5]), HEIGHT_M)
    rgb_u8, depth_m = (one.copy() for one in world.render(T))
    worlds[1].render(T)
    again = world.render(T)
    assert np.array_equal(again[0], rgb_u8)
    assert np.array_equal(again[1], depth_m)
    assert rgb_u8.std() > 5


def test_the_map_has_obstacles_and_room_for_episodes(worlds):
    for world in worlds:
        assert (world.grid.cells == OCCUPIED).any()
        for one in make_episodes(world.grid, 3, 0.35, seed=0):
            assert world.clearance_m(np.stack([one.start_pose[:2], one.goal_xy_m])).min() > 0.3


def test_equal_seeds_give_equal_maps_and_others_do_not(worlds):
    again = make_miniworld(3, 0, Robot(), HEIGHT_M, CAMERA)
    other = make_miniworld(4, 0, Robot(), HEIGHT_M, CAMERA)
    assert np.array_equal(again.grid.cells, worlds[0].grid.cells)
    assert not np.array_equal(other.grid.cells, worlds[0].grid.cells)
