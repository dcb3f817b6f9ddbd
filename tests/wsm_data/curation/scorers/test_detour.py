import math
from dataclasses import replace

import pytest

from wsm_data.curation.scorers.detour import DETOUR, detour_ratio
from wsm_data.curation.scorers.scorer import require_score
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import sample_distance


def walled(floor, wall_m):
    """A room of 6 m x 6 m with a wall from its south up to `wall_m` in the middle."""
    return floor(6.0, 6.0, [(2.95, 0.0, 3.05, wall_m)])


def ratio(drive, grid):
    start, goal = (1.525, 1.525), (4.475, 1.525)
    trajectory = drive(grid, [start, (3.0, 5.5), goal])
    field = geodesic_distance(grid, trajectory.goal_xy_m, 0.25, 0.2)
    distance = float(sample_distance(field, grid, trajectory.path_xy_m[:1])[0])
    return detour_ratio(drive(grid, [start, (3.0, 5.5), goal], start_distance_m=distance))


def test_without_anything_in_the_way_it_is_one(drive, floor):
    # the stored field rounds the start to its cell's neighbours: a hundredth of the way at most
    assert ratio(drive, floor(6.0, 6.0)) == pytest.approx(1.0, abs=0.01)


def test_around_a_wall_it_is_the_taut_string_over_the_straight_line(drive, floor):
    top = 4.0 + 0.25  # the tip of the wall and the robot's radius
    string = 2 * math.hypot(3.0 - 0.3 - 1.525, top - 1.525) + 0.6  # at least: past the corners of a wide bar
    assert ratio(drive, walled(floor, 4.0)) == pytest.approx(string / 2.95, rel=0.05)


def test_the_longer_the_wall_the_greater_it_is(drive, floor):
    found = [ratio(drive, walled(floor, wall_m)) for wall_m in (1.0, 2.0, 3.0, 4.0, 5.0)]
    assert found == sorted(found)
    assert found[-1] > 2 * found[0]


def test_inside_the_goal_region_it_is_one_and_it_is_never_below(drive, floor):
    grid = floor(6.0, 6.0)
    assert detour_ratio(drive(grid, [(1.0, 1.0), (1.1, 1.0)], start_distance_m=0.0)) == 1.0
    assert detour_ratio(drive(grid, [(1.0, 1.0), (3.0, 1.0)], start_distance_m=1.799)) == 1.0


def test_without_a_way_there_is_no_ratio(home):
    assert detour_ratio(replace(home, start_distance_m=math.inf)) is None
    assert math.isnan(require_score(DETOUR.info, None, "k"))
