import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import build_scene_map, floor_levels
from wsm_data.maps.voxels import voxels_from_depth
from wsm_data.schema.dataset import Robot
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN
from wsm_data.schema.surface import SurfaceVoxels


def grid_for(boxes, height_m, floor_z_m=0.0, origin="cloud", marked=()):
    """Occupancy of boxes (ix, iy, iz), of which some are marked as obstacles."""
    boxes = sorted({*boxes, *marked})
    cells = np.array(boxes, np.int16).reshape(-1, 3)
    voxels = SurfaceVoxels(cells=cells, obstacle=np.array([box in marked for box in boxes], np.bool_), origin=origin)
    return occupancy_for(build_scene_map(voxels, floor_levels([floor_z_m]), Robot(), 2.0), floor_z_m, height_m, Robot())


def at(grid, ix, iy):
    return grid.cells[iy - grid.origin_cell[1], ix - grid.origin_cell[0]]


FLOOR = [(x, y, 0) for x in range(-5, 6) for y in range(-5, 6)]


@pytest.mark.parametrize("origin", ["cloud", "depth"])
def test_a_table_at_70_cm_is_driven_under_by_a_low_robot_only(origin):
    table = [(x, y, 70) for x in range(3) for y in range(3)]
    assert at(grid_for(FLOOR + table, 0.5, origin=origin), 1, 1) == FREE
    assert at(grid_for(FLOOR + table, 1.2, origin=origin), 1, 1) == OCCUPIED
    assert at(grid_for(FLOOR + table, 1.2, origin=origin), -4, -4) == FREE


def test_the_band_is_cut_to_the_centimetre():
    for layer, height_m, expected in (
        (14, 0.5, FREE),  # its lower side is under the ground clearance of 0.15 m
        (15, 0.5, OCCUPIED),
        (49, 0.5, OCCUPIED),
        (50, 0.5, FREE),
        (50, 0.501, OCCUPIED),
    ):
        assert at(grid_for([*FLOOR, (2, 2, layer)], height_m), 2, 2) == expected, (layer, height_m)


def test_the_band_stands_on_the_floor_of_the_episode():
    raised = [(x, y, z + 307) for x, y, z in FLOOR]
    for floor_z_m in (3.07, 3.0699, 3.0701):  # a floor's noise is under a millimetre
        assert at(grid_for([*raised, (2, 2, 307 + 15)], 0.5, floor_z_m), 2, 2) == OCCUPIED
        assert at(grid_for([*raised, (2, 2, 307 + 14)], 0.5, floor_z_m), 2, 2) == FREE


def test_a_marked_box_occupies_from_the_floor_on():
    assert at(grid_for(FLOOR, 0.5, marked=[(1, 1, 5)]), 1, 1) == OCCUPIED
    assert at(grid_for(FLOOR, 0.5, marked=[(1, 1, -1)]), 1, 1) == FREE  # below the floor
    assert at(grid_for(FLOOR, 0.5, marked=[(1, 1, 50)]), 1, 1) == FREE  # above the robot


def test_unknown_is_unknown():
    grid = grid_for([(0, 0, 0), (4, 4, 0), (2, 2, 180), (1, 1, -16), (3, 3, -15)], 0.5)
    assert at(grid, 0, 0) == FREE
    assert at(grid, 2, 2) == UNKNOWN  # a ceiling alone
    assert at(grid, 1, 1) == UNKNOWN  # too deep to be the floor
    assert at(grid, 3, 3) == FREE  # 0.15 m lower is driven down
    assert at(grid, 0, 4) == UNKNOWN


def test_a_stray_box_of_fused_depth_occupies_nothing_but_two_do():
    stray = (2, 2, 30)
    assert at(grid_for([*FLOOR, stray], 0.5, origin="cloud"), 2, 2) == OCCUPIED
    assert at(grid_for([*FLOOR, stray], 0.5, origin="depth"), 2, 2) == FREE
    for second in ((2, 2, 31), (3, 3, 20)):  # in the same cell, in a cell at its corner
        assert at(grid_for([*FLOOR, stray, second], 0.5, origin="depth"), 2, 2) == OCCUPIED
    assert at(grid_for([*FLOOR, stray, (4, 2, 30)], 0.5, origin="depth"), 2, 2) == FREE
    assert at(grid_for([(2, 2, 30), (4, 4, 0)], 0.5, origin="depth"), 2, 2) == UNKNOWN  # and is no evidence of a floor


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    low_m=st.floats(0.1, 2.0),
    high_m=st.floats(0.1, 2.0),
    origin=st.sampled_from(["cloud", "depth"]),
)
def test_a_taller_robot_never_has_fewer_occupied_cells(seed, low_m, high_m, origin):
    low_m, high_m = sorted((low_m, high_m))
    boxes = [tuple(map(int, b)) for b in np.random.default_rng(seed).integers([0, 0, -20], [9, 9, 210], (60, 3))]
    low = grid_for(boxes, low_m, origin=origin, marked=boxes[:5] if origin == "cloud" else ())
    high = grid_for(boxes, high_m, origin=origin, marked=boxes[:5] if origin == "cloud" else ())
    assert (high.cells[low.cells == OCCUPIED] == OCCUPIED).all()
    assert (low.cells[high.cells == FREE] == FREE).all()


def test_each_storey_of_a_house_has_its_own_map():
    boxes = [*FLOOR, *((x, y, z + 280) for x, y, z in FLOOR), *((1, 1, z) for z in range(16, 200)), (-2, -2, 280 + 40)]
    cells = np.array(sorted(boxes), np.int16)
    voxels = SurfaceVoxels(cells=cells, obstacle=np.zeros(len(cells), np.bool_), origin="cloud")
    house = build_scene_map(voxels, floor_levels([0.0, 2.8, 0.004]), Robot(), 2.0)
    ground, upper = (occupancy_for(house, z, 1.0, Robot()) for z in (0.0, 2.8))
    assert (at(ground, 1, 1), at(ground, -2, -2)) == (OCCUPIED, FREE)
    assert (at(upper, 1, 1), at(upper, -2, -2)) == (FREE, OCCUPIED)


def test_what_else_is_in_the_scene_moves_no_cell():
    wall = [(2, y, z) for y in range(-5, 6) for z in range(20, 120)]
    near = grid_for(FLOOR + wall, 0.8)
    far = grid_for([*FLOOR, *wall, (400, -300, 0)], 0.8)
    for x in range(-5, 6):
        for y in range(-5, 6):
            assert at(near, x, y) == at(far, x, y)


def test_points_on_a_floor_and_a_wall_make_a_floor_and_a_wall():
    rng = np.random.default_rng(0)
    floor = np.c_[rng.uniform(0, 2, (20_000, 2)), rng.normal(0, 0.002, 20_000)]
    wall = np.c_[np.full(20_000, 1.02), rng.uniform(0, 2, 20_000), rng.uniform(0, 2.4, 20_000)]
    voxels = voxels_from_depth([floor, wall])
    grid = occupancy_for(build_scene_map(voxels, floor_levels([0.0]), Robot(), 2.0), 0.0, 0.6, Robot())
    expected = np.full((40, 40), FREE)
    expected[:, 20] = OCCUPIED
    assert np.array_equal(grid.cells, expected)
