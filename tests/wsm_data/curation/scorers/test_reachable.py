import math
from dataclasses import replace

from wsm_data.curation.scorers.reachable import goal_reachable
from wsm_data.curation.scorers.trajectory import trajectory_of


def test_a_path_that_ends_at_the_goal_reaches_it(home):
    assert goal_reachable(home) == 1.0


def test_behind_a_closed_wall_the_goal_cannot_be_reached(drive, floor):
    grid = floor(8.0, 6.0, [(3.9, 0.0, 4.1, 6.0)])
    assert goal_reachable(drive(grid, [(1.0, 3.0), (3.0, 3.0)], goal_xy_m=(7.0, 3.0))) == 0.0


def test_a_clip_whose_path_leads_through_a_wall_does_not_reach_its_goal(hall_clip):
    assert goal_reachable(trajectory_of(hall_clip())) == 1.0
    assert goal_reachable(trajectory_of(hall_clip(walled=True))) == 0.0


def test_a_gap_too_narrow_for_the_robot_leads_nowhere_though_the_path_does(drive, floor):
    for gap_m, expected in ((0.3, 0.0), (0.8, 1.0)):
        grid = floor(8.0, 6.0, [(3.9, 0.0, 4.1, 3.0 - gap_m / 2), (3.9, 3.0 + gap_m / 2, 4.1, 6.0)])
        assert goal_reachable(drive(grid, [(1.0, 3.0), (7.0, 3.0)])) == expected


def test_start_and_goal_may_stand_nearer_to_a_wall_than_the_robot_is_wide(drive, floor):
    assert goal_reachable(drive(floor(8.0, 6.0), [(0.1, 3.0), (7.9, 3.0)])) == 1.0


def test_an_infinite_expert_distance_says_that_there_is_no_way(home):
    assert goal_reachable(replace(home, start_distance_m=math.inf)) == 0.0
