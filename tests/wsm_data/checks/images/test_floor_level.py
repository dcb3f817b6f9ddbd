"""A camera 0.5 m over a floor, with a table that hides part of it."""

import numpy as np
import pytest

from wsm_data.checks.images.floor_level import check_floor_level
from wsm_data.errors import Reason

SLOPE = np.random.default_rng(0).uniform(0.1, 0.7, 4000)


def check(drop_m, height_m=0.5, slope=SLOPE):
    return check_floor_level(np.broadcast_to(drop_m, slope.shape), np.full(len(slope), height_m), slope, "a/b/0")


def test_a_floor_at_its_height_is_kept():
    verdict = check(0.5)
    assert (verdict.reason, verdict.measured["floor_share"]) == (None, 1.0)


@pytest.mark.parametrize("error", [-0.2, -0.05, 0.05, 0.3])
def test_a_mount_or_a_scale_that_is_off_is_found_with_the_height_that_was_seen(error):
    verdict = check(0.5 * (1 + error))
    assert verdict.reason is Reason.MOUNT_FLOOR_DISAGREE
    assert verdict.measured["best_height_ratio"] == pytest.approx(1 + error, abs=0.03)  # the borders count to it


def test_furniture_may_hide_three_quarters_of_the_floor():
    table = np.where(np.arange(4000) % 4 > 0, 0.2, 0.5)
    assert check(table).keep


def test_walls_alone_are_no_floor_at_another_height():
    assert check(np.random.default_rng(1).uniform(-0.5, 0.45, 4000)).keep


def test_furniture_that_fills_the_view_is_no_floor_since_something_lies_beneath():
    """As in two generated trajectories that were refused once: 18 % at one height, 3 % at the floor's."""
    shelves = np.clip(np.random.default_rng(2).normal(0.64, 0.14, 4000), 0.2, 1.0)
    assert np.mean(np.abs(shelves - 0.64) < 0.03) == pytest.approx(0.17, abs=0.02)
    verdict = check(0.5 * shelves)
    assert verdict.measured["floor_share"] < 0.05
    assert verdict.measured["share_beneath"] > 0.2
    assert verdict.keep


def test_rays_that_would_meet_the_floor_far_away_tell_nothing():
    verdict = check(0.7, slope=np.full(4000, 0.05))  # at 10 m
    assert verdict.keep
    assert verdict.measured == {"floor_points": 0}
