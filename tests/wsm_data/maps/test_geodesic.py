import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.footprint import traversable
from wsm_data.maps.geodesic import geodesic_distance, geodesic_field
from wsm_data.schema.occupancy import OccupancyGrid

RESOLUTION_M = 0.05
SINGLE = 2e-7  # float32 keeps 24 bits: a relative error of 6e-8, three of which add up at most


def field_of(free, goal, goal_radius_m=0.0, blocked=None, reach_m=0.354):
    return geodesic_field(free, ~free if blocked is None else blocked, goal, RESOLUTION_M, goal_radius_m, reach_m)


def centres(shape):
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    return columns, rows


def some_free_cell(free, seed):
    cells = np.argwhere(free)
    row, column = cells[np.random.default_rng(seed).integers(len(cells))]
    return int(column), int(row)


def test_an_empty_room_is_measured_as_the_crow_flies_less_the_goal_radius():
    free = np.ones((40, 60), np.bool_)
    goal = (17.3, 22.8)
    columns, rows = centres(free.shape)
    straight_m = np.hypot(columns - goal[0], rows - goal[1]) * RESOLUTION_M
    np.testing.assert_allclose(field_of(free, goal, 0.2), np.maximum(straight_m - 0.2, 0), rtol=SINGLE, atol=1e-8)


def test_the_goal_region_is_exactly_zero():
    field = field_of(np.ones((30, 30), np.bool_), (15.0, 15.0), 0.2)
    columns, rows = centres(field.shape)
    inside = np.hypot(columns - 15, rows - 15) * RESOLUTION_M <= 0.2 - 1e-9
    assert (field[inside] == 0.0).all()
    assert (field[~inside & (np.hypot(columns - 15, rows - 15) > 4.01)] > 0).all()


def test_an_l_shaped_corridor_is_measured_around_its_inner_corner():
    free = np.zeros((40, 40), np.bool_)
    free[2:7, 2:37] = True  # along x
    free[2:37, 2:7] = True  # along y; the inner corner is the lattice point (7, 7)
    field = field_of(free, (34.0, 4.0))
    # from (4, 34) to (34, 4) around the corner: the shortest way turns in the cell (6, 6), which touches it
    expected = (math.hypot(34 - 6, 6 - 4) + math.hypot(6 - 4, 34 - 6)) * RESOLUTION_M
    assert field[34, 4] == pytest.approx(expected, rel=SINGLE)


@pytest.mark.parametrize("seed", range(5))
def test_distances_are_those_of_the_graph_of_all_visible_cells(cluttered_room, shortest_paths, seed):
    free = cluttered_room(seed, size=30, things=6)
    goal = some_free_cell(free, seed)
    reference_m = shortest_paths(free, goal) * RESOLUTION_M
    field = field_of(free, (float(goal[0]), float(goal[1]))).astype(np.float64)
    assert np.array_equal(np.isfinite(field), np.isfinite(reference_m))
    reached = np.isfinite(reference_m) & (reference_m > 0)
    error = field[reached] / reference_m[reached] - 1
    assert error.min() > -SINGLE  # every stored length is that of a path that exists
    # the two limits of the issue, for paths of a metre and less, where a lattice step weighs most
    assert np.abs(error).mean() < 1e-3
    assert error.max() < 5e-3


@pytest.mark.parametrize("seed", range(4))
def test_turning_or_mirroring_the_map_turns_or_mirrors_the_field(cluttered_room, seed):
    free = cluttered_room(seed, size=30)
    column, row = some_free_cell(free, seed)
    field = field_of(free, (float(column), float(row)))
    mirrored = field_of(free[:, ::-1], (float(29 - column), float(row)))
    transposed = field_of(free.T, (float(row), float(column)))
    # sums in another order differ by rounding; between equally long ways nothing can differ by more
    np.testing.assert_allclose(mirrored[:, ::-1], field, rtol=SINGLE)
    np.testing.assert_allclose(transposed.T, field, rtol=SINGLE)


def test_where_the_map_stands_in_a_larger_one_changes_nothing(cluttered_room):
    free = cluttered_room(3)
    column, row = some_free_cell(free, 3)
    wide = np.zeros((70, 90), np.bool_)
    wide[20:56, 11:47] = free
    inside = field_of(wide, (column + 11.0, row + 20.0))[20:56, 11:47]
    assert np.array_equal(inside, field_of(free, (float(column), float(row))))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), x=st.floats(1.6, 18.4), y=st.floats(1.6, 18.4))
def test_no_distance_is_below_the_straight_line(seed, x, y):
    free = np.random.default_rng(seed).random((21, 21)) > 0.3
    free[round(y), round(x)] = True
    field = field_of(free, (x, y)).astype(np.float64)
    columns, rows = centres(free.shape)
    straight_m = np.hypot(columns - x, rows - y) * RESOLUTION_M
    assert (field >= straight_m * (1 - SINGLE) - 1e-9).all()


@pytest.mark.parametrize("seed", range(3))
def test_mutually_visible_cells_differ_by_no_more_than_the_way_between_them(cluttered_room, sees, seed):
    free = cluttered_room(seed)
    field = field_of(free, tuple(map(float, some_free_cell(free, seed)))).astype(np.float64)
    cells = [(int(x), int(y)) for y, x in np.argwhere(np.isfinite(field))]
    rng = np.random.default_rng(seed)
    checked = 0
    for i, j in rng.integers(0, len(cells), (2000, 2)):
        a, b = cells[i], cells[j]
        if sees(~free, a, b):
            way_m = math.hypot(a[0] - b[0], a[1] - b[1]) * RESOLUTION_M
            # 0.2 %: what turning near corners only leaves (bench/geodesic.py)
            assert abs(field[a[1], a[0]] - field[b[1], b[0]]) <= way_m + 2e-3 * field.max(initial=0, where=free)
            checked += 1
    assert checked > 200


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_exactly_the_cells_connected_to_the_goal_by_steps_have_a_distance(seed):
    free = np.random.default_rng(seed).random((25, 25)) > 0.38
    goal = some_free_cell(free, seed)
    connected = np.zeros_like(free)
    connected[goal[1], goal[0]] = True
    while True:  # grow by the four neighbours until nothing changes
        padded = np.pad(connected, 1)
        grown = (padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:] | connected) & free
        if np.array_equal(grown, connected):
            break
        connected = grown
    assert np.array_equal(np.isfinite(field_of(free, (float(goal[0]), float(goal[1])))), connected)


def test_nothing_slips_between_two_cells_that_touch_at_a_corner():
    free = np.ones((6, 6), np.bool_)
    free[np.arange(6), np.arange(6)] = False
    field = field_of(free, (4.0, 1.0))
    assert np.isinf(field[4, 1])
    assert np.isfinite(field[0, 1])


def test_a_goal_that_is_blocked_or_off_the_map_is_reached_from_nowhere():
    free = np.ones((8, 8), np.bool_)
    free[3, 3] = False
    assert np.isinf(field_of(free, (3.0, 3.0))).all()
    assert np.isinf(field_of(free, (30.0, 3.0))).all()


def test_cells_cannot_be_traversable_and_blocked():
    free = np.ones((4, 4), np.bool_)
    with pytest.raises(ValueError, match="16 cells are both"):
        geodesic_field(free, free, (1.0, 1.0), RESOLUTION_M, 0.2, 0.3)


@pytest.fixture
def doorway():
    """Two rooms 2 m wide with a wall one cell thick between them and a gap in it, of the given number of cells."""

    def build(gap_cells):
        cells = np.zeros((44, 44), np.uint8)
        cells[[0, -1]] = cells[:, [0, -1]] = 1
        cells[:, 22] = 1
        cells[22 : 22 + gap_cells, 22] = 0
        return OccupancyGrid(cells=cells, origin_cell=(-7, 12), resolution_m=RESOLUTION_M)

    return build


def test_a_gap_wider_than_the_footprint_is_open_and_a_narrower_one_stays_closed(doorway):
    for gap_cells, is_open in ((9, True), (8, False)):  # centres 10 cells apart leave one row at 5 cells = 0.25 m
        grid = doorway(gap_cells)
        field = geodesic_distance(grid, grid.cell_centres_xy_m(np.array([35.0, 30.0])), 0.25, 0.2)
        assert np.isfinite(field[30, 8]) == is_open
        # a cell in the gap sees the near room either way
        assert np.isfinite(field[24, 22])


def test_a_cell_too_near_to_a_wall_has_the_distance_over_the_best_cell_it_sees(doorway):
    grid = doorway(12)
    goal = grid.cell_centres_xy_m(np.array([8.0, 8.0]))
    field = geodesic_distance(grid, goal, 0.25, 0.0)
    free = traversable(grid, 0.25)
    assert not free[8, 2]
    # straight along the row: from (2, 8) to the first traversable cell (5, 8) and on to (8, 8)
    assert field[8, 2] == pytest.approx(6 * RESOLUTION_M, rel=SINGLE)
    # past the goal's reach: from (1, 20) the best rim cell (column 5) by trying them all
    rim = [math.hypot(5 - 1, row - 20) + math.hypot(8 - 5, row - 8) for row in range(13, 28)]
    rim = [way for row, way in zip(range(13, 28), rim, strict=True) if math.hypot(4, row - 20) <= 0.25 * 2**0.5 / 0.05]
    assert field[20, 1] == pytest.approx(min(rim) * RESOLUTION_M, rel=SINGLE)
    assert np.isinf(field[grid.cells == 1]).all()


def test_a_goal_too_near_to_a_wall_is_reached_over_the_cells_that_see_it(doorway):
    grid = doorway(12)
    goal_cell = (2.0, 30.0)
    field = geodesic_distance(grid, grid.cell_centres_xy_m(np.array(goal_cell)), 0.25, 0.0)
    assert not traversable(grid, 0.25)[30, 2]
    assert field[30, 2] == 0.0
    assert field[30, 3] == pytest.approx(RESOLUTION_M)  # a neighbour in the same place goes straight
    assert field[30, 12] == pytest.approx(10 * RESOLUTION_M, rel=SINGLE)
    assert np.isfinite(field[20, 35])  # and through the door into the other room


def test_a_goal_beyond_a_thin_wall_is_not_reached_through_it():
    cells = np.zeros((30, 41), np.uint8)
    cells[[0, -1]] = cells[:, [0, -1]] = 1
    cells[:, 20] = 1
    grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=RESOLUTION_M)
    field = geodesic_distance(grid, grid.cell_centres_xy_m(np.array([18.0, 15.0])), 0.25, 0.2)
    assert np.isfinite(field[15, 10])
    assert np.isinf(field[:, 20:]).all()


def test_unknown_cells_are_neither_driven_through_nor_seen_through(grid_of):
    grid = grid_of(
        """
        .......
        .......
        ???????
        .......
        .......
        """
    )
    field = geodesic_distance(grid, grid.cell_centres_xy_m(np.array([3.0, 0.0])), 0.05, 0.0)
    assert np.isfinite(field[:2]).all()
    assert np.isinf(field[2:]).all()
