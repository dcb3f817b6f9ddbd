import math

import numpy as np
import pytest

from wsm_data.curation.scorers.goal_view import goal_behind_walls_share, goal_out_of_view_share
from wsm_data.schema.occupancy import UNKNOWN


def test_behind_a_wall_the_goal_is_hidden_until_the_corner_of_the_wall_is_passed(drive, floor):
    grid = floor(8.0, 6.0, [(3.95, 0.0, 4.05, 4.0)])
    trajectory = drive(grid, [(2.0, 1.0), (2.0, 5.0), (6.0, 5.0)], goal_xy_m=(6.0, 2.0), step_m=0.01)
    # the sight over the near upper corner (3.95, 4.0): the ray from the goal through (4.05, 4.0) goes up to the left,
    # and meets x = 2 at a height of 4 + (4.05 - 2) * 2 / 1.95, above the room, so it is seen along y = 5 only
    at_y_5 = 4.05 - (5.0 - 4.0) * 1.95 / 2.0
    hidden_m = 4.0 + (at_y_5 - 2.0)
    assert goal_behind_walls_share(trajectory) == pytest.approx(hidden_m / 8.0, abs=0.02 / 8.0)


def test_a_longer_wall_hides_more_and_unknown_cells_hide_nothing(drive, floor):
    def share(length_m, *kind):
        grid = floor(8.0, 6.0, [(3.95, 0.0, 4.05, length_m, *kind)])
        return goal_behind_walls_share(drive(grid, [(2.0, 1.0), (2.0, 5.5), (6.0, 5.5)], goal_xy_m=(6.0, 2.0)))

    found = [share(length_m) for length_m in (1.0, 2.0, 3.0, 4.0, 5.0)]
    assert found == sorted(found)
    assert found[-1] > 0.5
    assert share(5.0, UNKNOWN) == 0.0


def test_without_walls_nothing_is_hidden(drive, floor):
    assert goal_behind_walls_share(drive(floor(8.0, 6.0), [(1.0, 1.0), (7.0, 5.0)])) == 0.0


@pytest.mark.parametrize(
    ("turned_deg", "seen"), [(0, True), (35, True), (36, False), (-32, True), (-33, False), (180, False)]
)
def test_the_goal_is_in_view_up_to_the_edge_of_the_image_on_either_side(drive, floor, turned_deg, seen):
    # fx = 237.2, cx = 150 of 320: atan(150.5 / 237.2) = 32.4 deg to the left, atan(169.5 / 237.2) = 35.6 to the right;
    # a camera turned to the left by an angle has a goal straight ahead of it on its right
    left_deg, right_deg = (math.degrees(math.atan2(edge, 237.2)) for edge in (150.5, 169.5))
    assert (32.3 < left_deg < 32.5, 35.5 < right_deg < 35.7) == (True, True)
    trajectory = drive(
        floor(8.0, 6.0), [(1.0, 3.0), (2.0, 3.0)], goal_xy_m=(7.0, 3.0), heading_rad=np.radians(turned_deg)
    )
    assert goal_out_of_view_share(trajectory) == (0.0 if seen else 1.0)


def test_driving_past_the_goal_loses_it_from_view(drive, floor):
    trajectory = drive(floor(8.0, 6.0), [(1.0, 3.0), (7.0, 3.0)], goal_xy_m=(4.0, 3.5), step_m=0.01)
    lost_m = 0.5 / math.tan(math.atan2(150.5, 237.2))  # the goal lies to the left
    assert goal_out_of_view_share(trajectory) == pytest.approx((3.0 + lost_m) / 6.0, abs=0.02 / 6.0)


def test_in_the_goal_region_nothing_is_out_of_view(drive, floor):
    trajectory = drive(floor(8.0, 6.0), [(3.9, 3.0), (4.1, 3.0)], goal_xy_m=(4.0, 3.0), heading_rad=np.pi / 2)
    assert goal_out_of_view_share(trajectory) == 0.0
