import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.planners.steering import Steering

LEFT, RIGHT = (0.0, 1.0), (0.0, -1.0)


def towards(bearing_deg, distance_m=5.0):
    bearing = np.radians(bearing_deg)
    return distance_m * np.array([[np.cos(bearing), np.sin(bearing)]])


@given(st.floats(90, 270), st.floats(0.5, 15))
def test_a_goal_behind_is_answered_with_a_turn_and_never_with_a_straight_line(bearing_deg, distance_m):
    path = Steering().path(towards(bearing_deg, distance_m), 0, 5.0)
    assert (path == (LEFT if bearing_deg <= 180 else RIGHT)).all()


def test_a_goal_ahead_is_answered_with_the_way_to_it():
    path = Steering().path(towards(5), 0, 5.0)
    np.testing.assert_allclose(np.arctan2(path[:, 1], path[:, 0]), np.radians(5), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(np.diff(path, axis=0), axis=1), 0.1, atol=1e-12)


def test_a_goal_at_the_robot_is_answered_with_standing_still():
    assert (Steering().path(towards(100, 0.01), 0, 5.0) == 0).all()


def test_a_turn_that_has_begun_goes_on_until_the_way_is_almost_ahead():
    steering = Steering()
    assert (steering.path(towards(60), 0, 5.0) == LEFT).all()
    assert (steering.path(towards(20), 1, 5.0) == LEFT).all()
    assert steering.path(towards(8), 2, 5.0)[0, 0] > 0
    assert steering.path(towards(20), 3, 5.0)[0, 0] > 0  # from the straight, 20 deg is no reason to turn


def test_where_there_is_little_room_ahead_it_turns_to_the_way_before_it_drives():
    assert Steering().path(towards(20), 0, 1.0)[0, 0] > 0
    assert (Steering().path(towards(20), 0, 0.3) == LEFT).all()


def test_near_the_far_side_the_turn_keeps_its_direction():
    steering = Steering()
    assert (steering.path(towards(175), 0, 0.0) == LEFT).all()
    assert (steering.path(towards(-178), 1, 0.0) == LEFT).all()
    assert (steering.path(towards(-60), 2, 0.0) == RIGHT).all()


def test_a_long_turn_is_broken_by_a_way_straight_ahead_where_there_is_room():
    steering, bearing, ahead, longest, turning = Steering(), 180.0, 0, 0, 0
    for step in range(60):
        path = steering.path(towards(bearing), step, 1.0)
        if path[0, 0] > 0 and bearing > 10:
            ahead, turning = ahead + 1, 0
        elif path[0, 0] == 0:
            bearing -= np.degrees(0.075)
            turning += 1
        longest = max(longest, turning)
    assert ahead == 2  # 2 steps at 0.5 m/s are 0.15 m, and 0.1 m in 30 steps is what counts as moving
    assert longest < 29


def test_without_room_the_turn_goes_on():
    steering = Steering()
    assert all((steering.path(towards(180), step, 0.1) == LEFT).all() for step in range(60))


def test_a_path_is_cut_where_the_way_bends():
    corner = np.array([[1.0, 0.0], [1.0, 3.0]])
    path = Steering().path(corner, 0, 5.0)
    np.testing.assert_allclose(path[-1], (1.0, 0.0), atol=1e-9)
