import numpy as np
import pytest

from wsm_data.curation.scorers.passage import narrowest_passage_m
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid

R = 0.05


def door(floor, width_m, middle_m=3.0):
    low = middle_m - width_m / 2
    return floor(8.0, 6.0, [(3.95, 0.0, 4.05, low), (3.95, low + width_m, 4.05, 6.0)])


@pytest.mark.parametrize("cells", range(10, 26))
def test_straight_through_a_door_it_is_the_width_of_the_door_exactly(drive, floor, cells):
    width_m = cells * R
    grid = door(floor, width_m, middle_m=3.0 + (cells % 2) * R / 2)
    assert narrowest_passage_m(drive(grid, [(1.0, 3.0), (7.0, 3.0)])) == pytest.approx(width_m, abs=1e-9)


def test_a_narrower_door_is_harder(drive, floor):
    found = [narrowest_passage_m(drive(door(floor, width_m), [(1.0, 3.0), (7.0, 3.0)])) for width_m in (1.4, 1.0, 0.7)]
    assert found == sorted(found, reverse=True)


@pytest.mark.parametrize("way", [[(3.0, 1.0), (5.0, 5.0)], [(1.0, 3.2), (7.0, 3.2)], [(1.0, 1.3), (7.0, 4.7)]])
def test_the_angle_and_the_place_at_which_a_door_is_driven_through_do_not_matter(drive, floor, way):
    assert narrowest_passage_m(drive(door(floor, 1.0), way)) == pytest.approx(1.0, abs=1e-9)


def test_in_a_corridor_at_any_angle_it_is_the_width_to_two_cells(drive):
    for angle_rad in np.linspace(0, np.pi / 2, 7):
        x, y = np.meshgrid((np.arange(200) + 0.5) * R, (np.arange(200) + 0.5) * R)
        axis = np.array([np.cos(angle_rad), np.sin(angle_rad)])
        across = (y - 5.0) * axis[0] - (x - 5.0) * axis[1]
        cells = np.where(np.abs(across) < 0.5, FREE, OCCUPIED).astype(np.uint8)
        grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=R)
        trajectory = drive(grid, [5.0 - 2.5 * axis, 5.0 + 2.5 * axis])
        # a cell belongs to the wall when its centre does: up to a diagonal of a cell on either side
        assert narrowest_passage_m(trajectory) == pytest.approx(1.0, abs=2 * np.sqrt(2) * R)


def test_another_door_that_the_expert_did_not_take_does_not_count(drive, floor):
    grid = floor(8.0, 6.0, [(3.95, 0.0, 4.05, 1.0), (3.95, 1.7, 4.05, 4.0)])  # 0.7 m here, 2 m over there
    assert narrowest_passage_m(drive(grid, [(1.0, 1.35), (7.0, 1.35)])) == pytest.approx(0.7, abs=1e-9)


def test_a_start_beside_a_wall_is_no_passage(drive, floor):
    assert narrowest_passage_m(drive(floor(8.0, 6.0), [(0.3, 3.0), (4.0, 3.0), (7.7, 3.0)])) == pytest.approx(
        2 * (0.3 + 0.5),
        abs=2 * R,  # half a metre into the room, where the widest path sets out
    )


def test_a_path_through_an_obstacle_has_no_passage(drive, floor):
    assert narrowest_passage_m(drive(floor(8.0, 6.0, [(3.9, 0.0, 4.1, 6.0)]), [(1.0, 3.0), (7.0, 3.0)])) == 0.0
