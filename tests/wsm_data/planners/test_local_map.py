import numpy as np

from wsm_data.planners.depth_scan import ScanConfig, scan_depth
from wsm_data.planners.local_map import LocalMap
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN


def at(grid, x, y):
    column, row = np.floor(grid.fractional_cells(np.array([x, y])) + 0.5).astype(int)
    return grid.cells[row, column]


def test_before_any_scan_only_the_place_of_the_robot_is_free():
    grid = LocalMap(0.25).grid(np.array([[3.0, -1.0]]))
    assert at(grid, 0.0, 0.0) == FREE
    assert at(grid, 1.0, 0.0) == at(grid, 3.0, -1.0) == UNKNOWN


def test_a_wall_is_occupied_what_lies_before_it_free_and_what_lies_behind_unknown(camera, look_at):
    known = LocalMap(0.25)
    known.add(scan_depth(look_at(2.02), camera, ScanConfig()), np.zeros(3))
    grid = known.grid(np.array([[4.0, 0.0]]))
    assert [at(grid, x, 0.0) for x in (1.0, 1.9, 2.02, 2.2)] == [FREE, FREE, OCCUPIED, UNKNOWN]
    assert at(grid, 1.0, 2.0) == UNKNOWN  # beside the view


def test_a_scan_is_entered_where_the_robot_stood(camera, look_at):
    known = LocalMap(0.25)
    known.add(scan_depth(look_at(2.02), camera, ScanConfig()), np.array([1.0, -1.0, np.pi / 2]))
    grid = known.grid(np.array([[0.0, 0.0]]))
    assert at(grid, 1.0, 1.02) == OCCUPIED
    assert at(grid, 1.0, 0.5) == FREE


def test_what_is_seen_free_often_enough_outweighs_one_hit(camera, look_at):
    known = LocalMap(0.25)
    known.add(scan_depth(look_at(1.02, (-0.02, 0.02)), camera, ScanConfig()), np.zeros(3))
    for _ in range(8):  # a hit weighs six
        known.add(scan_depth(look_at(3.0), camera, ScanConfig()), np.zeros(3))
    assert at(known.grid(np.zeros((1, 2))), 1.02, 0.0) == FREE
