import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from wsm_data.maps.bottleneck import flood_levels

EIGHT = np.ones((3, 3))


def flooded_by_hand(level, passable, seeds):
    """Raise the water step by step: a cell is wet at the lowest water at which it is connected with a seed."""
    found = np.full(level.shape, np.inf)
    for water in np.unique(level):
        pools, _ = ndimage.label(passable & (level <= water), structure=EIGHT)
        wet = np.isin(pools, np.unique(pools[seeds])) & (pools > 0)
        found[wet & np.isinf(found)] = water
    return found


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), levels=st.sampled_from([3, 20, 10_000]), walls=st.sampled_from([0.0, 0.3, 0.6]))
def test_a_flood_rises_as_far_as_a_search_over_all_waters_says(seed, levels, walls):
    rng = np.random.default_rng(seed)
    level = rng.integers(0, levels, size=(13, 17)).astype(np.float64)
    passable, seeds = rng.random(level.shape) >= walls, rng.random(level.shape) < 0.03
    everywhere = np.ones(level.shape, bool)
    assert np.array_equal(flood_levels(level, passable, seeds, everywhere), flooded_by_hand(level, passable, seeds))


def test_the_flood_may_end_when_the_wanted_cells_are_wet():
    level = np.array([[0.0, 1.0, 2.0, 9.0]])
    everything = np.ones(level.shape, bool)
    wanted = np.array([[False, True, False, False]])
    found = flood_levels(level, everything, level == 0, wanted)
    assert found[0, 1] == 1.0
    assert np.isinf(found[0, 3])


def test_the_widest_path_goes_around_a_pillar_on_its_wider_side():
    clearance = np.array([[3.0, 1.0, 3.0], [3.0, 0.0, 3.0], [3.0, 2.0, 3.0]])
    seeds, goal = np.zeros((3, 3), bool), np.zeros((3, 3), bool)
    seeds[1, 0], goal[1, 2] = True, True
    assert -flood_levels(-clearance, clearance > 0, seeds, goal)[1, 2] == 2.0


def test_a_cell_that_is_not_passable_is_never_reached_and_no_seed_reaches_nothing():
    level, everywhere = np.zeros((2, 2)), np.ones((2, 2), bool)
    walled = np.array([[True, False], [False, False]])
    assert np.isinf(flood_levels(level, walled, everywhere, everywhere)).tolist() == [[False, True], [True, True]]
    assert np.isinf(flood_levels(level, everywhere, ~everywhere, everywhere)).all()
