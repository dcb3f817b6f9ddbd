import numpy as np
import pytest

from wsm_data.geometry.planar import camera_over
from wsm_data.maps.footprint import clearance_m
from wsm_data.schema.dataset import Robot
from wsm_data.schema.occupancy import FREE
from wsm_data.sim.episodes import make_episodes
from wsm_data.sim.homes import make_home_world


@pytest.fixture(scope="module")
def world(small_camera):
    return make_home_world(1000, 0, Robot(), 0.3, small_camera)


def test_map_and_mesh_agree_on_where_obstacles_are(world):
    rows, columns = np.nonzero(world.grid.cells == FREE)
    chosen = np.random.default_rng(0).choice(len(rows), 2000, replace=False)
    places = world.grid.cell_centres_xy_m(np.column_stack([columns, rows])[chosen].astype(float))
    by_map, by_mesh = np.minimum(clearance_m(world.grid, places), 0.7), np.minimum(world.clearance_m(places), 0.7)
    assert (by_mesh - by_map > -0.03).all()  # a cell is never farther than what stands in it, but for sampling
    assert (by_mesh - by_map < 0.08).all()  # nor nearer by more than its diagonal


def test_the_camera_sees_the_obstacle_that_the_robot_would_run_into(world, small_camera):
    episode = make_episodes(world.grid, 1, 0.35, seed=0)[0]
    _, depth_m = world.render(camera_over(episode.start_pose, 0.3))
    middle = float(depth_m[9, 15:17].mean())  # just below the horizon, ahead
    ahead = episode.start_pose[:2] + (middle - 0.05) * np.array(
        [np.cos(episode.start_pose[2]), np.sin(episode.start_pose[2])]
    )
    assert world.clearance_m(ahead[None])[0] < 0.3


def test_a_home_is_named_after_its_seed_and_number(world):
    assert world.scene == "home_1000_0000"
