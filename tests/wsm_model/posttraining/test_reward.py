"""A corridor towards a goal: D is the way that is left along x, so progress is what is gained in x."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.maps.reward_map import RewardMap
from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid
from wsm_model.posttraining.reward import (
    RewardConfig,
    dream_paths_m,
    progress_cost_m2,
    rewards,
    score_dreams,
)

RESOLUTION_M, GOAL_X_M = 0.05, 4.0
EXPERT_M = GOAL_X_M - np.array([1.0, 1.1, 1.2, 1.3, 1.4])
PACE = np.array([[1.1, 0.0], [1.2, 0.0], [1.3, 0.0], [1.4, 0.0]])
START = np.array([1.0, 0.0])
CONFIG = RewardConfig()


@pytest.fixture
def corridor():
    cells = np.full((60, 100), FREE, np.uint8)  # x 0 to 5 m, y -1.5 to 1.5 m
    x_m = (np.arange(100) + 0.5) * RESOLUTION_M
    field = np.broadcast_to(np.rint(np.abs(GOAL_X_M - x_m) * 1000), (60, 100)).astype(np.uint16)
    grid = OccupancyGrid(cells=cells, origin_cell=(0, -30), resolution_m=RESOLUTION_M)
    return RewardMap(grid=grid, geodesic_mm=field, robot_radius_m=0.25)


def with_wall(corridor, columns):
    cells = corridor.grid.cells.copy()
    cells[:, columns] = OCCUPIED
    grid = OccupancyGrid(cells=cells, origin_cell=(0, -30), resolution_m=RESOLUTION_M)
    return RewardMap(grid=grid, geodesic_mm=corridor.geodesic_mm, robot_radius_m=0.25)


def test_the_pace_of_the_expert_costs_nothing_and_another_pace_what_it_differs_by(corridor):
    """At cell centres D is exact to the millimetre: cells of 5 cm, steps of 10 cm."""
    paths = np.stack([PACE, PACE + np.array([0.0, 0.2]), np.repeat(START[None], 4, axis=0)])
    scored = score_dreams(corridor, START, paths, EXPERT_M, CONFIG)
    assert scored.safe.all()
    np.testing.assert_allclose(scored.cost_m2, [0, 0, 0.01], atol=1e-12)  # standing still: 0.1^2 in every step
    np.testing.assert_allclose(scored.value, [1, 1, np.exp(-1)], rtol=1e-12)


def test_a_tie_of_the_best_gains_no_bonus():
    """Costs 0, 0 and T: 1 / (2 + 1/e) each of the best, 1/e of that for the third."""
    reward, _ = rewards(np.ones(3, bool), np.array([0.0, 0.0, 0.01]), CONFIG)
    total = 2 + np.exp(-1)
    np.testing.assert_allclose(reward, [1 / total, 1 / total, np.exp(-1) / total], rtol=1e-12)


def test_the_best_gains_its_margin():
    """C1 = 0.01, C2 = 0.02, T = 0.01: the margin is 0.01 / 0.02, and the softmax 1 / (1 + 1/e)."""
    reward, _ = rewards(np.ones(2, bool), np.array([0.01, 0.02]), CONFIG)
    share = 1 / (1 + np.exp(-1))
    np.testing.assert_allclose(reward, [min(1, share + 0.5), 1 - share], rtol=1e-12)
    without, _ = rewards(np.ones(2, bool), np.array([0.01, 0.02]), RewardConfig(bonus=False))
    np.testing.assert_allclose(without, [share, 1 - share], rtol=1e-12)


def test_a_single_safe_dream_has_all_reward_and_none_has_none():
    reward, value = rewards(np.array([False, True]), np.array([0.0, 5.0]), CONFIG)
    assert reward.tolist() == [0.0, 1.0]
    assert value[0] == 0
    reward, value = rewards(np.zeros(3, bool), np.zeros(3), CONFIG)
    assert (reward.tolist(), value.tolist()) == ([0.0] * 3, [0.0] * 3)


def test_an_unreachable_goal_is_worth_nothing(corridor):
    field = np.full_like(corridor.geodesic_mm, 65535)
    nowhere = RewardMap(grid=corridor.grid, geodesic_mm=field, robot_radius_m=0.25)
    scored = score_dreams(nowhere, START, PACE[None], EXPERT_M, CONFIG)
    assert scored.safe.tolist() == [True]
    assert scored.cost_m2.tolist() == [np.inf]
    assert not scored.tells


def test_an_expert_that_stands_at_its_end_is_followed_by_standing(corridor):
    """It is shorter than L: its distance stays what it is."""
    standing = np.full(5, 3.0)
    scored = score_dreams(corridor, START, np.stack([PACE, np.repeat(START[None], 4, axis=0)]), standing, CONFIG)
    assert scored.cost_m2[1] == 0
    assert scored.reward.argmax() == 1


def test_a_wall_of_6_cm_between_two_samples_is_not_passed(corridor):
    """Samples 0.8 m apart, a quarter of a metre away from it on either side."""
    wall = with_wall(corridor, slice(40, 42))  # x 2.0 to 2.1 m: two cells, of which 6 cm are the least that fill any
    through = np.array([[[1.2, 0.0], [1.5, 0.0], [2.6, 0.0], [2.8, 0.0]]])
    assert score_dreams(corridor, START, through, EXPERT_M, CONFIG).safe.tolist() == [True]
    assert score_dreams(wall, START, through, EXPERT_M, CONFIG).safe.tolist() == [False]


@settings(max_examples=30, deadline=None)
@given(angle=st.floats(-3.1, 3.1), x=st.floats(-5, 5), y=st.floats(-5, 5))
def test_where_dreams_lead_does_not_depend_on_where_the_model_believes_to_be(angle, x, y):
    """A rigid motion of all that it estimates changes nothing; 1e-9 m is the rounding of float64 at some metres."""
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:2, 3] = x, y
    rng = np.random.default_rng(0)
    dreams = np.tile(np.eye(4), (3, 4, 1, 1))
    dreams[..., :3, 3] = rng.normal(size=(3, 4, 3))
    true, query = np.eye(4), np.eye(4)
    true[:3, 3], query[:3, 3] = (1, 2, 0.5), (0.3, -0.1, 0)
    start, paths = dream_paths_m(true, query, dreams)
    moved_start, moved = dream_paths_m(true, T @ query, T @ dreams)
    assert start.tolist() == moved_start.tolist() == [1, 2]
    np.testing.assert_allclose(moved, paths, atol=1e-9)


def test_cost_is_the_mean_over_steps_of_the_squared_difference():
    distance = np.array([[3.0, 2.5, 2.5], [3.0, 3.2, np.inf]])
    cost = progress_cost_m2(distance, np.array([3.0, 2.8, 2.6]))
    np.testing.assert_allclose(cost, [(0.3**2 + 0.2**2) / 2, np.inf])
