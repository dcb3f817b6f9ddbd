import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.half_cells import half_cell_clearance, nodes_near
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN

ROUNDING = 1e-9  # square roots of whole numbers, in cells


def random_cells(seed, share, shape=(7, 9)):
    return np.where(np.random.default_rng(seed).random(shape) < share, OCCUPIED, UNKNOWN).astype(np.uint8)


def nodes(cells):
    rows, columns = 2 * cells.shape[0] + 1, 2 * cells.shape[1] + 1
    return np.stack(np.meshgrid(np.arange(columns) / 2, np.arange(rows) / 2), axis=-1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), share=st.sampled_from([0.0, 0.02, 0.1, 0.5]))
def test_a_node_is_as_far_from_the_nearest_square_as_clamping_to_each_square_says(seed, share):
    cells = random_cells(seed, share)
    places, expected = nodes(cells), np.full((15, 19), np.inf)
    for row, column in np.argwhere(cells == OCCUPIED):
        nearest = np.clip(places, [column, row], [column + 1, row + 1])
        expected = np.minimum(expected, np.hypot(*np.moveaxis(places - nearest, -1, 0)))
    assert half_cell_clearance(cells) == pytest.approx(expected, abs=ROUNDING)


def test_the_middle_of_a_corridor_is_half_its_width_from_both_walls_whatever_its_width():
    for width in range(1, 9):
        cells = np.full((width + 2, 5), FREE, np.uint8)
        cells[0] = cells[-1] = OCCUPIED
        assert half_cell_clearance(cells).max() == width / 2


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), points=st.integers(1, 5), radius=st.sampled_from([0.0, 0.4, 1.5, 4.0]))
def test_nodes_are_near_a_path_where_the_nearest_of_many_points_on_it_is(seed, points, radius):
    rng = np.random.default_rng(seed)
    path = rng.uniform(-1, 10, size=(points, 2))
    cells = random_cells(seed, 0.0)
    dense = np.concatenate([np.linspace(path[i], path[min(i + 1, points - 1)], 2000) for i in range(points)])
    gap = np.sqrt(((nodes(cells)[:, :, None] - dense) ** 2).sum(axis=-1)).min(axis=-1)
    near = nodes_near(path, cells.shape, radius)
    spacing = 0.01  # points on a stretch of at most 16 cells are so far apart: nearer to the border nothing is said
    assert near[gap < radius - spacing].all()
    assert not near[gap > radius].any()
