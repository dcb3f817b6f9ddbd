import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.holes import fill_holes
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

CELL_M = 0.05


def grid_of(cells):
    return OccupancyGrid(cells=np.array(cells, np.uint8), origin_cell=(3, -4), resolution_m=CELL_M)


def slow_fill(cells, reach):
    """The rule cell by cell, as it is stated."""
    filled = np.array(cells)
    for row, column in np.argwhere(cells == UNKNOWN):
        around = cells[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
        ways = [
            cells[row, column + 1 :],
            cells[row, :column][::-1],
            cells[row + 1 :, column],
            cells[:row, column][::-1],
        ]
        gaps = [next((n for n, cell in enumerate(way) if cell != UNKNOWN), None) for way in ways]  # None: to the edge
        ends_free = all(gap is not None and way[gap] == FREE for gap, way in zip(gaps, ways, strict=True))
        if ends_free and (around != OCCUPIED).all() and max(gaps[0] + gaps[1], gaps[2] + gaps[3]) < reach:
            filled[row, column] = FREE
    return filled


@given(arrays(np.uint8, (9, 11), elements=st.sampled_from([FREE] * 12 + [UNKNOWN] * 8 + [OCCUPIED])), st.integers(0, 3))
def test_the_rule_is_the_one_that_is_stated(cells, reach):
    filled, count = fill_holes(grid_of(cells), reach)
    np.testing.assert_array_equal(filled.cells, slow_fill(cells, reach))
    assert count == np.count_nonzero(filled.cells != cells)
    assert (filled.origin_cell, filled.resolution_m) == ((3, -4), CELL_M)


@pytest.mark.parametrize(("side", "filled"), [(1, True), (2, True), (3, False)])
def test_a_hole_is_filled_whole_up_to_the_given_side_and_a_larger_one_not_at_all(side, filled):
    cells = np.zeros((12, 12), np.uint8)
    cells[4 : 4 + side, 4 : 4 + side] = UNKNOWN
    found, count = fill_holes(grid_of(cells), 2)
    assert count == (side**2 if filled else 0)
    assert (found.cells == FREE).all() == filled


def test_what_lies_beside_an_obstacle_stays_unknown_also_diagonally():
    cells = np.zeros((9, 9), np.uint8)
    cells[4, 4], cells[6, 6] = UNKNOWN, OCCUPIED
    assert fill_holes(grid_of(cells), 2)[1] == 0
    assert fill_holes(grid_of(cells), 1)[1] == 1


def test_the_edge_of_what_was_seen_stays_where_it_is():
    cells = np.zeros((9, 9), np.uint8)
    cells[:, 5:] = UNKNOWN
    cells[2, 0] = UNKNOWN
    assert fill_holes(grid_of(cells), 3)[1] == 0


def test_zero_fills_nothing_and_less_is_refused():
    grid = grid_of([[FREE, UNKNOWN, FREE]] * 3)
    assert fill_holes(grid, 0)[1] == 0
    with pytest.raises(ValueError, match="must not be negative, found -1"):
        fill_holes(grid, -1)


def test_in_a_map_with_a_fifth_of_its_floor_unknown_distances_come_out_right_once_holes_are_filled():
    cells = np.zeros((160, 200), np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    cells[40:, 60:62] = cells[:110, 130:132] = cells[60:75, 20:40] = cells[90:100, 85:110] = OCCUPIED
    hole = (np.random.default_rng(0).random(cells.shape) < 0.2) & (cells == FREE)
    hole[26:31, 176:181] = False  # the goal itself was seen
    goal_xy_m = np.array([3, -4]) * CELL_M + np.array([178.5, 28.5]) * CELL_M
    holed = grid_of(np.where(hole, UNKNOWN, cells))

    def mean_error(grid):
        true_m, found_m = (geodesic_distance(one, goal_xy_m, 0.25, 0.2) for one in (grid_of(cells), grid))
        both = np.isfinite(true_m) & np.isfinite(found_m) & (true_m > 0.5) & ~hole
        assert both.sum() > 15_000
        return float((found_m[both] / true_m[both] - 1).mean())

    assert mean_error(holed) > 0.03
    assert 0 <= mean_error(fill_holes(holed, 2)[0]) < 0.005
