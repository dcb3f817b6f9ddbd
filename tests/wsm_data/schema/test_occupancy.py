"""Cells of a map and positions in the world."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

ORIGINS = st.tuples(st.integers(-3000, 3000), st.integers(-3000, 3000))
RESOLUTIONS = st.sampled_from([0.01, 0.05, 0.2, 1.0])
COORDINATES = st.tuples(st.floats(-150, 150), st.floats(-150, 150))


def grid(origin_cell=(0, 0), resolution_m=0.05, shape=(3, 4)):
    return OccupancyGrid(cells=np.zeros(shape, np.uint8), origin_cell=origin_cell, resolution_m=resolution_m)


@given(ORIGINS, RESOLUTIONS, COORDINATES)
def test_positions_to_cells_and_back_is_the_identity(origin_cell, resolution_m, xy_m):
    cells = grid(origin_cell, resolution_m)
    back = cells.cell_centres_xy_m(cells.fractional_cells(np.array(xy_m)))
    np.testing.assert_allclose(back, xy_m, rtol=0, atol=1e-11)  # rounding at 3000 cells and 150 m


@given(ORIGINS, RESOLUTIONS, st.integers(0, 500), st.integers(0, 500))
def test_whole_numbers_are_cell_centres(origin_cell, resolution_m, column, row):
    cells = grid(origin_cell, resolution_m)
    x_m, y_m = cells.cell_centres_xy_m(np.array([column, row]))
    assert x_m == pytest.approx((origin_cell[0] + column) * resolution_m + resolution_m / 2, abs=1e-9)
    assert y_m == pytest.approx((origin_cell[1] + row) * resolution_m + resolution_m / 2, abs=1e-9)


@given(ORIGINS, st.integers(0, 500), st.integers(0, 500), st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_every_point_of_a_cell_rounds_to_that_cell(origin_cell, column, row, share_x, share_y):
    cells = grid(origin_cell)
    x0, y0 = cells.origin_xy_m
    point = np.array([x0 + (column + share_x) * 0.05, y0 + (row + share_y) * 0.05])
    assert np.rint(cells.fractional_cells(point)).astype(int).tolist() == [column, row]


def test_the_origin_is_the_lower_corner_of_the_first_cell():
    cells = grid(origin_cell=(-2, 10))
    assert cells.origin_xy_m == pytest.approx((-0.1, 0.5), abs=1e-15)
    np.testing.assert_allclose(cells.fractional_cells(np.array(cells.origin_xy_m)), [-0.5, -0.5], atol=1e-12)


def test_two_crops_of_one_map_give_the_same_position_to_the_same_cell():
    whole, crop = grid(origin_cell=(-40, 7)), grid(origin_cell=(-30, 12))
    np.testing.assert_allclose(
        whole.cell_centres_xy_m(np.array([15, 9])), crop.cell_centres_xy_m(np.array([5, 4])), atol=1e-15
    )


def test_batches_of_positions_keep_their_shape():
    assert grid().fractional_cells(np.zeros((5, 6, 2))).shape == (5, 6, 2)
    assert grid().cell_centres_xy_m(np.zeros((5, 6, 2))).shape == (5, 6, 2)


def test_cells_hold_free_occupied_and_unknown_only():
    cells = np.array([[FREE, OCCUPIED], [UNKNOWN, FREE]], np.uint8)
    OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)
    cells[0, 0] = 2
    with pytest.raises(ValueError, match=r"cells must be 0, 1 or 255, found \[0, 1, 2, 255\]"):
        OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)


@pytest.mark.parametrize("resolution_m", [0.0, -0.05, float("nan"), float("inf")])
def test_a_resolution_that_is_no_length_is_refused(resolution_m):
    with pytest.raises(ValueError, match="resolution_m must be a positive length"):
        grid(resolution_m=resolution_m)


def test_cells_cannot_be_written_to():
    assert not grid().cells.flags.writeable


def test_cells_of_another_dtype_are_refused():
    with pytest.raises(ValueError, match=r"^cells must be uint8 \[any, any\], found int64 \[2, 2\]"):
        OccupancyGrid(cells=np.zeros((2, 2), np.int64), origin_cell=(0, 0), resolution_m=0.05)
