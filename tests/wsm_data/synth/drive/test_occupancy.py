import numpy as np
import pytest

from wsm_data.synth.drive.occupancy import CELL_M, Clearance, SceneColumns, clearance


@pytest.fixture
def table(small) -> SceneColumns:
    """A floor of 2 m by 1 m with a plate at 0.7 m over one cell and a sill of 0.1 m over another."""
    floor = np.ones((20, 40), np.bool_)
    return SceneColumns(
        cell=np.array([10 * 40 + 20, 10 * 40 + 5]), z_m=np.array([0.7, 0.1]), floor=floor, origin_m=(-1.0, 0.5)
    )


def test_low_robots_go_under_a_plate_and_all_drive_over_a_sill(table, small):
    low, high = clearance(table, 0.5, small), clearance(table, 0.9, small)
    assert (low.distance_m > 0).all()
    assert np.argwhere(high.distance_m == 0).tolist() == [[10, 20]]


def test_clearance_is_the_distance_to_the_nearest_obstacle_s_cell(table, small):
    high = clearance(table, 0.9, small)
    assert high.distance_m[10, 26] == pytest.approx(6 * CELL_M)
    assert high.distance_m[13, 24] == pytest.approx(5 * CELL_M)


def test_head_room_is_kept_above_the_robot(table, small):
    assert (clearance(table, 0.7 - small.head_room_m + 0.001, small).distance_m == 0).any()
    assert (clearance(table, 0.7 - small.head_room_m - 0.001, small).distance_m > 0).all()


def test_cells_without_floor_are_not_driven_on(small):
    floor = np.ones((5, 5), np.bool_)
    floor[2, 3] = False
    empty = SceneColumns(cell=np.zeros(0, np.int64), z_m=np.zeros(0), floor=floor, origin_m=(0.0, 0.0))
    assert np.argwhere(clearance(empty, 1.0, small).distance_m == 0).tolist() == [[2, 3]]


def test_positions_and_cells_agree():
    room = Clearance(distance_m=np.arange(12.0).reshape(3, 4), origin_m=(-1.0, 2.0))
    centres = room.centres(np.arange(12))
    assert centres[5] == pytest.approx((-1.0 + 1.5 * CELL_M, 2.0 + 1.5 * CELL_M))
    assert room.at(centres) == pytest.approx(np.arange(12.0))
    assert room.at((centres[5] + centres[6]) / 2) == pytest.approx(5.5)


def test_a_home_s_floor_lies_on_the_world_s_own_grid(home, columns):
    assert np.array(columns.origin_m) / CELL_M == pytest.approx(np.round(np.array(columns.origin_m) / CELL_M))
    area = columns.floor.sum() * CELL_M**2
    assert area == pytest.approx(sum(room.area_m2 for room in home.floor_plan.rooms), rel=0.1)
