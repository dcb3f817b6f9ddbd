import pytest

from wsm_data.curation.scorers.dead_end import TRAPPED_M, greatest_retreat_m, trapped_share


def out_of_a_dead_end(drive, floor, arm_m):
    """Out of three walls whose opening faces away from the goal, and around them."""
    things = [(4.0, 2.0, 4.1, 4.0), (4.0 - arm_m, 2.0, 4.0, 2.1), (4.0 - arm_m, 3.9, 4.0, 4.0)]
    out = 4.0 - arm_m - 0.5
    way = [(3.5, 3.0), (out, 3.0), (out, 1.3), (5.0, 1.3), (7.0, 3.0)]
    return drive(floor(8.0, 6.0, things), way)


def test_out_of_a_dead_end_one_retreats_by_the_length_of_its_walls_and_a_robot(drive, floor):
    for arm_m in (1.0, 1.5, 2.0):
        # around the tip of a wall, (4 - arm, 2), at a radius of 0.25 m, from 3.5 m before the goal: to the cell
        around = ((7.0 - (4.0 - arm_m) + 0.25 * 0.8) ** 2 + (1.0 + 0.25 * 0.6) ** 2) ** 0.5
        found = greatest_retreat_m(out_of_a_dead_end(drive, floor, arm_m))
        assert found == pytest.approx(around - 3.5, abs=3 * 0.05)


def test_a_deeper_dead_end_is_harder_by_both(drive, floor):
    trajectories = [out_of_a_dead_end(drive, floor, arm_m) for arm_m in (0.3, 0.8, 1.2, 1.6, 2.0)]
    retreats = [greatest_retreat_m(one) for one in trajectories]
    shares = [trapped_share(one) for one in trajectories]
    assert retreats == sorted(retreats)
    assert shares == sorted(shares)


def test_a_wall_that_is_passed_by_sliding_along_it_traps_nobody(drive, floor):
    grid = floor(8.0, 6.0, [(3.0, 2.5, 5.0, 2.6)])  # along the way
    trajectory = drive(grid, [(1.0, 3.0), (7.0, 3.0)])
    assert greatest_retreat_m(trajectory) <= TRAPPED_M
    assert trapped_share(trajectory) == 0.0


def test_a_path_that_does_not_lead_to_the_goal_region_has_no_retreat_and_is_trapped_all_along(drive, floor):
    grid = floor(8.0, 6.0, [(3.9, 0.0, 4.1, 6.0)])
    trajectory = drive(grid, [(1.0, 3.0), (3.0, 3.0)], goal_xy_m=(7.0, 3.0))
    assert greatest_retreat_m(trajectory) is None
    assert trapped_share(trajectory) == pytest.approx(1.0)
