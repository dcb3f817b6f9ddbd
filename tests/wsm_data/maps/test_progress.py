import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import field_to_mm, mm_to_field, progress, sample_distance
from wsm_data.schema.occupancy import OccupancyGrid


@pytest.fixture
def empty_room():
    return OccupancyGrid(cells=np.zeros((60, 80), np.uint8), origin_cell=(10, -20), resolution_m=0.05)


def test_distances_at_cell_centres_are_those_of_the_cells(empty_room):
    field = np.random.default_rng(0).uniform(0, 5, (60, 80)).astype(np.float32)
    cells = np.array([[0, 0], [3, 7], [79, 59]])
    found = sample_distance(field, empty_room, empty_room.cell_centres_xy_m(cells))
    np.testing.assert_allclose(found, field[cells[:, 1], cells[:, 0]], atol=1e-9)


def test_a_linear_field_is_interpolated_exactly(empty_room):
    rows, columns = np.mgrid[:60, :80]
    field = (0.05 * columns + 0.03 * rows).astype(np.float32)
    cells = np.random.default_rng(1).uniform([0, 0], [79, 59], (50, 2))
    found = sample_distance(field, empty_room, empty_room.cell_centres_xy_m(cells))
    np.testing.assert_allclose(found, cells @ [0.05, 0.03], atol=1e-6)  # float32 of a few metres


def test_neighbours_without_a_distance_are_left_out(empty_room):
    field = np.full((60, 80), np.inf, np.float32)
    field[10, 10], field[10, 11] = 1.0, 2.0
    at = empty_room.cell_centres_xy_m(np.array([[10.25, 10.4], [10.25, 9.5], [12.5, 10.0], [40.0, 40.0], [900.0, 0.0]]))
    assert sample_distance(field, empty_room, at).tolist() == pytest.approx([1.25, 1.25, np.inf, np.inf, np.inf])


def test_the_expert_arrives_at_exactly_zero_at_its_own_pace(empty_room):
    path = np.array([[1.0, 0.0], [1.0, 0.4], [1.0, 0.8], [1.03, 0.82]])
    field = geodesic_distance(empty_room, path[-1], 0.25, 0.2)
    distance = sample_distance(field, empty_room, path)
    assert distance[-1] == 0.0
    assert distance[-2] == 0.0  # 0.04 m away: inside the goal region
    assert distance[0] - distance[1] == pytest.approx(0.4, abs=2e-3)  # 0.03 m to the side; bilinear


def test_a_field_belongs_to_a_map_of_its_own_shape(empty_room):
    with pytest.raises(ValueError, match="does not belong"):
        sample_distance(np.zeros((3, 3), np.float32), empty_room, np.zeros((1, 2)))


@given(st.lists(st.floats(0, 65.5, width=32), min_size=1, max_size=20))
def test_millimetres_keep_distances_to_half_a_millimetre(values):
    field = np.array([values], np.float32)
    np.testing.assert_allclose(mm_to_field(field_to_mm(field)), field, atol=0.0005 + 65.6 * 2**-24)


def test_unreachable_is_its_own_value_and_long_ways_saturate_below_it():
    stored = field_to_mm(np.array([[0.0, np.inf, 70.0, 65.534]], np.float32))
    assert stored.tolist() == [[0, 65535, 65534, 65534]]
    assert mm_to_field(stored).tolist()[0][:2] == [0.0, np.inf]


def test_progress_is_the_distance_gained_in_each_step():
    assert progress(np.array([3.0, 2.5, 2.75])).tolist() == [0.5, -0.25]
