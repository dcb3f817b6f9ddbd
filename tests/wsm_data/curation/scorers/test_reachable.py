from wsm_data.curation.scorers.reachable import goal_reachable


def test_a_path_that_ends_at_the_goal_reaches_it(home):
    assert goal_reachable(home) == 1.0


def test_behind_a_closed_wall_the_goal_cannot_be_reached(drive, floor):
    grid = floor(8.0, 6.0, [(3.9, 0.0, 4.1, 6.0)])
    assert goal_reachable(drive(grid, [(1.0, 3.0), (3.0, 3.0)], goal_xy_m=(7.0, 3.0))) == 0.0
