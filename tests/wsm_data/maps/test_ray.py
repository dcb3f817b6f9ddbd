import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.ray import free_ahead_m
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid

RESOLUTION_M = 0.05


def entered_m(grid, start_m, heading, most_m):
    """The nearest entry of the ray into any occupied square, by the slabs of each."""
    nearest = most_m
    direction = np.array([np.cos(heading), np.sin(heading)])
    for row, column in np.argwhere(grid.cells == OCCUPIED):
        low = (np.array([column, row]) + grid.origin_cell) * grid.resolution_m
        with np.errstate(divide="ignore"):
            cuts = np.sort([(low - start_m) / direction, (low + grid.resolution_m - start_m) / direction], axis=0)
        enter, leave = max(cuts[0].max(), 0.0), cuts[1].min()
        if enter < leave:
            nearest = min(nearest, enter)
    return nearest


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_a_ray_ends_where_it_enters_the_first_of_all_occupied_squares(seed):
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((20, 24)) < 0.05, OCCUPIED, FREE).astype(np.uint8)
    grid = OccupancyGrid(cells=cells, origin_cell=(-7, 100), resolution_m=RESOLUTION_M)
    starts = grid.cell_centres_xy_m(rng.uniform(-3, 23, size=(8, 2)))
    headings = rng.uniform(-7, 7, size=8)
    expected = [entered_m(grid, start, heading, 1.5) for start, heading in zip(starts, headings, strict=True)]
    # sums of up to 50 steps along an axis, each rounded once
    assert free_ahead_m(grid, starts, headings, 1.5) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("quarter", range(4))
def test_along_the_axes_a_wall_is_met_at_its_face(quarter):
    cells = np.full((21, 21), FREE, np.uint8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = OCCUPIED
    grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=RESOLUTION_M)
    middle = np.array([[10.5 * RESOLUTION_M, 10.5 * RESOLUTION_M]])
    assert free_ahead_m(grid, middle, np.array([quarter * np.pi / 2]), 5.0) == pytest.approx([9.5 * RESOLUTION_M])


def test_nothing_is_in_the_way_outside_the_map_and_inside_an_obstacle_there_is_no_way():
    grid = OccupancyGrid(cells=np.full((2, 2), OCCUPIED, np.uint8), origin_cell=(0, 0), resolution_m=RESOLUTION_M)
    starts = np.array([[5.0, 5.0], [0.05, 0.02]])
    assert free_ahead_m(grid, starts, np.zeros(2), 3.0).tolist() == [3.0, 0.0]
