from itertools import pairwise

import numpy as np
import pytest

from wsm_data.maps.footprint import clearance_m
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.planners.costs import Caution, prices
from wsm_data.planners.route import find_route, free_corridor_m

RADIUS_M = 0.25
CAUTION = Caution(margin_m=0.05, comfort_m=0.12)


def dense(points):
    return np.concatenate([np.linspace(a, b, 50) for a, b in pairwise(points)])


def test_a_route_through_the_door_keeps_the_footprint_free_and_is_hardly_longer_than_the_shortest(two_rooms):
    start, goal = np.array([1.0, 3.5]), np.array([5.0, 3.5])
    route = find_route(two_rooms, prices(two_rooms, RADIUS_M, CAUTION, through_unknown=False), start, goal)
    whole = np.concatenate([start[None], route])
    assert (route[-1] == goal).all()
    assert clearance_m(two_rooms, dense(whole)).min() >= RADIUS_M
    length = np.linalg.norm(np.diff(whole, axis=0), axis=1).sum()
    column, row = two_rooms.fractional_cells(start).round().astype(int)
    shortest = geodesic_distance(two_rooms, goal, RADIUS_M, 0.0)[row, column]
    assert shortest - 0.05 <= length < 1.1 * shortest


def test_a_goal_behind_a_wall_without_a_door_has_no_route(two_rooms):
    price = prices(two_rooms, RADIUS_M, CAUTION, through_unknown=False)
    price[:, 60] = np.inf
    assert find_route(two_rooms, price, np.array([1.0, 1.5]), np.array([5.0, 1.5])) is None


def test_the_corridor_ahead_ends_where_the_disc_touches(two_rooms):
    wall_x_m = 60 * 0.05
    pose = np.array([wall_x_m - RADIUS_M - 0.5, 3.0, 0.0])
    assert free_corridor_m(two_rooms, pose, RADIUS_M) == pytest.approx(0.5, abs=0.026)  # checked every 0.025 m
    assert free_corridor_m(two_rooms, np.array([1.5, 2.0, 0.0]), RADIUS_M) == 1.0
