import numpy as np
import pytest

from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import field_to_mm, sample_distance
from wsm_data.maps.reward_map import RewardMap
from wsm_data.schema.occupancy import OCCUPIED, OccupancyGrid

RESOLUTION_M, RADIUS_M, GOAL_RADIUS_M = 0.05, 0.1, 0.2


def room(rows, columns, origin_cell):
    """A free room with a wall that leaves a gap at its far end."""
    cells = np.zeros((rows, columns), np.uint8)
    cells[: rows - 10, columns // 2] = OCCUPIED
    return OccupancyGrid(cells=cells, origin_cell=origin_cell, resolution_m=RESOLUTION_M)


GRIDS = (room(40, 60, (-17, 3)), room(30, 44, (5, -8)))


def field_of(grid):
    low = np.array(grid.origin_xy_m)
    goal = low + (np.array(grid.cells.shape[::-1]) - 6) * RESOLUTION_M
    return geodesic_distance(grid, goal, RADIUS_M, GOAL_RADIUS_M)


@pytest.fixture(scope="module")
def maps():
    return [RewardMap(grid=grid, geodesic_mm=field_to_mm(field_of(grid)), robot_radius_m=RADIUS_M) for grid in GRIDS]


@pytest.mark.parametrize("number", [0, 1])
def test_distances_are_those_of_the_field_to_half_a_millimetre(maps, number):
    grid = GRIDS[number]
    rng = np.random.default_rng(number)
    size_m = np.array(grid.cells.shape[::-1]) * RESOLUTION_M
    points = np.array(grid.origin_xy_m) + rng.uniform(-0.1, 1.1, (4, 50, 2)) * size_m
    expected = sample_distance(field_of(grid), grid, points.reshape(-1, 2)).reshape(4, 50)
    found = maps[number].distance_m(points)
    assert found.shape == (4, 50)
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    finite = np.isfinite(expected)
    assert 50 < finite.sum() < 200
    # stored millimetres are off by half of one; interpolation does not add to it
    np.testing.assert_allclose(found[finite], expected[finite], rtol=0, atol=0.00051)


def test_progress_is_what_each_step_gains(maps):
    found = maps[0]
    straight = np.array(GRIDS[0].origin_xy_m) + np.stack([np.linspace(2.0, 2.3, 7), np.full(7, 1.0)], axis=1)
    distance = found.distance_m(straight)
    np.testing.assert_allclose(found.progress_m(straight), distance[:-1] - distance[1:])
    assert found.progress_m(straight).sum() == pytest.approx(distance[0] - distance[-1])
    # around the gap of the wall the way is longer than the flight: 0.3 m nearer, no more
    assert 0 < found.progress_m(straight).sum() <= 0.3 + 0.001


def test_progress_out_of_the_map_is_not_finite(maps):
    path = np.array([[-50.0, 0.0], [-50.1, 0.0], GRIDS[0].origin_xy_m])
    assert not np.isfinite(maps[0].progress_m(path)).any()


def test_a_path_is_free_where_the_footprint_fits(maps):
    found = maps[0]
    low = np.array(GRIDS[0].origin_xy_m)
    before = low + np.array([[0.5, 0.5], [1.2, 0.5]])
    through = low + np.array([[0.5, 0.5], [2.5, 0.5]])  # the wall stands between two free positions
    outside = low + np.array([[0.5, 0.5], [-0.5, 0.5]])
    assert (found.is_free(before), found.is_free(through), found.is_free(outside)) == (True, False, False)


def test_a_map_may_have_no_distance_at_all():
    grid = GRIDS[1]
    nowhere = RewardMap(grid=grid, geodesic_mm=np.full(grid.cells.shape, 65535, np.uint16), robot_radius_m=RADIUS_M)
    assert nowhere.distance_m(np.array([0.3, 0.1])) == np.inf
