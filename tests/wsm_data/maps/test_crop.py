import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.crop import crop_around, free_swept_cells
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


def random_grid(seed=0, shape=(20, 30)):
    cells = np.random.default_rng(seed).choice([FREE, OCCUPIED, UNKNOWN], shape).astype(np.uint8)
    return OccupancyGrid(cells=cells, origin_cell=(-4, 6), resolution_m=0.05)


@settings(max_examples=50)
@given(
    points=st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=4),
    margin_m=st.floats(0, 1.5),
)
def test_a_crop_holds_its_points_and_margin_and_is_unknown_outside_the_map(points, margin_m):
    grid = random_grid()
    crop = crop_around(grid, np.array(points), margin_m)
    low = np.array(crop.origin_xy_m)
    high = low + np.array(crop.cells.shape[::-1]) * 0.05
    points = np.array(points)
    assert (low <= points.min(axis=0) - margin_m + 1e-9).all()
    assert (high >= points.max(axis=0) + margin_m - 1e-9).all()
    assert (high - low <= np.ptp(points, axis=0) + 2 * margin_m + 2 * 0.05 + 1e-9).all()  # and no more than whole cells
    for row in range(crop.cells.shape[0]):
        for column in range(0, crop.cells.shape[1], 7):
            y, x = row + crop.origin_cell[1] - grid.origin_cell[1], column + crop.origin_cell[0] - grid.origin_cell[0]
            inside = 0 <= y < 20 and 0 <= x < 30
            assert crop.cells[row, column] == (grid.cells[y, x] if inside else UNKNOWN)


def test_unknown_cells_under_the_experts_footprint_are_freed_and_counted():
    cells = np.full((20, 40), UNKNOWN, np.uint8)
    cells[10, 20] = OCCUPIED
    cells[10, 21] = FREE
    grid = OccupancyGrid(cells=cells, origin_cell=(100, -50), resolution_m=0.05)
    path = grid.cell_centres_xy_m(np.array([[5.0, 10.0], [30.0, 10.0]]))
    swept, freed = free_swept_cells(grid, path, 0.1)
    rows, columns = np.mgrid[:20, :40]
    along = np.clip(columns, 5, 30)
    expected = np.hypot(columns - along, rows - 10) <= 2
    assert freed == expected.sum() - 2  # one was free, one is occupied
    assert np.array_equal(swept.cells == FREE, expected & (cells != OCCUPIED))
    assert swept.cells[10, 20] == OCCUPIED
    assert (grid.cells[10, 5:9] == UNKNOWN).all()  # the map that came in is as it was
    again, freed_again = free_swept_cells(swept, path, 0.1)
    assert freed_again == 0
    assert np.array_equal(again.cells, swept.cells)


def test_a_path_that_leaves_the_map_frees_what_is_on_it():
    grid = OccupancyGrid(cells=np.full((4, 4), UNKNOWN, np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    _, freed = free_swept_cells(grid, np.array([[-1.0, 0.1], [0.1, 0.1], [0.1, 0.1]]), 0.03)
    # rows 1 and 2 (0.025 m from the path) in columns 0 and 1; the next centre is 0.035 m from the end of the path
    assert freed == 4
