import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.footprint import clearance_m, footprint_is_free, footprints_are_free, traversable
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

RESOLUTION_M = 0.05


def random_grid(seed, occupied_share=0.05, shape=(24, 31)):
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random(shape) < occupied_share, OCCUPIED, np.where(rng.random(shape) < 0.1, UNKNOWN, FREE))
    return OccupancyGrid(cells=cells.astype(np.uint8), origin_cell=(-5, 40), resolution_m=RESOLUTION_M)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), radius_m=st.sampled_from([0.0, 0.05, 0.1, 0.15, 0.21, 0.25]))
def test_cells_are_traversable_where_no_occupied_centre_is_nearer_than_the_radius(seed, radius_m):
    grid = random_grid(seed)
    occupied = np.argwhere(grid.cells == OCCUPIED)
    expected = np.zeros(grid.cells.shape, np.bool_)
    for row, column in np.argwhere(grid.cells == FREE):
        squares = ((occupied - [row, column]) ** 2).sum(axis=1)  # whole numbers of cells
        # 0.25 / 0.05 is five cells: compared with a relative tolerance far below one part in 10^4 of a cell
        expected[row, column] = (np.sqrt(squares) >= radius_m / RESOLUTION_M - 1e-9).all()
    assert np.array_equal(traversable(grid, radius_m), expected)


def test_unknown_is_not_traversable_and_keeps_nobody_away(grid_of):
    grid = grid_of(
        """
        .?.
        ...
        """
    )
    assert traversable(grid, 0.25).tolist() == [[True, True, True], [True, False, True]]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_clearance_is_the_distance_to_the_nearest_occupied_square(seed):
    grid = random_grid(seed, occupied_share=0.01)
    rng = np.random.default_rng(seed)
    low = np.array(grid.origin_cell) * RESOLUTION_M
    xy = low + rng.uniform(-0.5, 2.0, (7, 2))
    squares = low + np.argwhere(grid.cells == OCCUPIED)[:, ::-1] * RESOLUTION_M
    outside = np.maximum(np.maximum(squares - xy[:, None], xy[:, None] - squares - RESOLUTION_M), 0)
    expected = np.hypot(outside[..., 0], outside[..., 1]).min(axis=1, initial=np.inf)
    np.testing.assert_allclose(clearance_m(grid, xy), expected, atol=1e-12)
    assert clearance_m(grid, xy.reshape(7, 1, 2)).shape == (7, 1)


def test_clearance_is_zero_inside_and_infinite_without_obstacles(grid_of):
    grid = grid_of(".#.")
    assert clearance_m(grid, np.array([[0.075, 0.025]])).tolist() == [0.0]
    assert clearance_m(grid_of("..."), np.array([[0.075, 0.025]])).tolist() == [math.inf]
    # 0.025 m from the centre of a cell to the edge of its neighbour
    assert clearance_m(grid, np.array([0.025, 0.025])) == pytest.approx(0.025)


def test_a_footprint_is_tested_between_the_positions_too(grid_of):
    grid = grid_of(
        """
        .....................
        .....................
        .....................
        .....................
        ..........#..........
        """
    )
    ends = np.array([[0.1, 0.2], [0.9, 0.2]])
    middle = np.array([[0.525, 0.2]])
    # the square's upper edge is at 0.05 m: 0.15 m below the path
    assert (clearance_m(grid, ends) > 0.16).all()
    assert clearance_m(grid, middle) == pytest.approx(0.15)
    assert footprint_is_free(grid, ends, 0.149)
    assert not footprint_is_free(grid, ends, 0.16)


def test_a_footprint_is_not_free_where_the_map_is_unknown_or_ends(grid_of):
    grid = grid_of("..?..")
    assert footprint_is_free(grid, np.array([[0.02, 0.02], [0.08, 0.02]]), 0.01)
    assert not footprint_is_free(grid, np.array([[0.02, 0.02], [0.2, 0.02]]), 0.01)
    assert not footprint_is_free(grid, np.array([[0.2, 0.02], [0.3, 0.02]]), 0.01)


def free_way(grid, path, radius_m):
    """The slow way: positions no more than half a cell apart, each in a FREE cell and as far from what is occupied."""
    dense = [path[:1]]
    for start, end in itertools.pairwise(path):
        steps = max(1, math.ceil(np.linalg.norm(end - start) / (grid.resolution_m / 2)))
        dense.append(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
    dense = np.concatenate(dense)
    columns, rows = np.floor(grid.fractional_cells(dense) + 0.5).astype(int).T
    if min(rows.min(), columns.min()) < 0 or rows.max() >= grid.cells.shape[0] or columns.max() >= grid.cells.shape[1]:
        return False
    return bool((grid.cells[rows, columns] == FREE).all() and (clearance_m(grid, dense) >= radius_m).all())


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_ways_are_free_where_the_slow_way_says_so(seed):
    rng = np.random.default_rng(seed)
    grid = random_grid(seed, occupied_share=0.01)
    low = np.array(grid.origin_cell) * RESOLUTION_M
    paths = low + rng.uniform(0.1, 1.1, (6, 1, 2)) + np.cumsum(rng.normal(0, 0.06, (6, 5, 2)), axis=1)
    found = footprints_are_free(grid, paths, 0.12)
    assert found.tolist() == [free_way(grid, path, 0.12) for path in paths]


def test_a_way_that_is_no_number_is_not_free(grid_of):
    grid = grid_of("....")
    assert not footprint_is_free(grid, np.array([[0.075, 0.025], [np.nan, 0.025]]), 0.0)
