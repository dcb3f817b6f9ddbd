import numpy as np
import pytest

from wsm_data.maps.retreat import necessary_retreat_m
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid

RESOLUTION_M = 0.05
ROBOT_M, GOAL_M = 0.1, 0.1


def room(rows=60, columns=100):
    cells = np.full((rows, columns), FREE, np.uint8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = OCCUPIED
    return cells


def retreat_m(cells, path_cells, goal_cell):
    grid = OccupancyGrid(cells=cells, origin_cell=(3, -8), resolution_m=RESOLUTION_M)
    path, goal = (grid.cell_centres_xy_m(np.array(one, float)) for one in (path_cells, goal_cell))
    return necessary_retreat_m(grid, path, goal, ROBOT_M, GOAL_M)


def test_in_an_empty_room_nobody_has_to_move_away_from_the_goal():
    assert retreat_m(room(), [(10, 30), (50, 12), (90, 30)], (90, 30)).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("arms", [8, 16, 24])
def test_in_a_dead_end_one_has_to_go_back_as_far_as_its_walls_reach(arms):
    cells = room()
    cells[20:41, 50] = OCCUPIED  # the back wall, towards the goal
    cells[20, 50 - arms : 50] = cells[40, 50 - arms : 50] = OCCUPIED
    goal, start = (90, 30), (47, 30)
    [retreat] = retreat_m(cells, [start], goal)
    # around the tip of an arm, two cells (the robot's radius) from it, at (50 - arms - 2, 20) or beside it at 18
    tips = [(50 - arms - 2, 20), (50 - arms - 1, 18)]
    around = min(np.hypot(90 - x, 30 - y) for x, y in tips)
    assert retreat == pytest.approx((around - 43) * RESOLUTION_M, abs=2 * RESOLUTION_M)  # the raster of the way around


def test_a_deeper_dead_end_asks_for_more():
    found = []
    for arms in range(4, 30, 2):
        cells = room()
        cells[20:41, 50] = OCCUPIED
        cells[20, 50 - arms : 50] = cells[40, 50 - arms : 50] = OCCUPIED
        found.append(float(retreat_m(cells, [(47, 30)], (90, 30))[0]))
    assert found == sorted(found)
    assert found[-1] > found[0] + 0.8


def test_without_a_way_to_the_goal_region_it_is_infinite():
    cells = room()
    cells[:, 50] = OCCUPIED
    assert np.isinf(retreat_m(cells, [(10, 30)], (90, 30))).all()


def test_the_path_itself_is_passable_even_where_the_robot_does_not_fit():
    cells = room()
    cells[:, 50] = OCCUPIED
    cells[30, 50] = FREE  # a gap of one cell
    path = np.column_stack([np.linspace(10, 90, 161), np.full(161, 30.0)])
    assert retreat_m(cells, path, (90, 30)).max() < np.inf
