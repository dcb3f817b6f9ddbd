import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.scorers.turning import SHARP_TURN_M, sharpest_turn_rad, total_turning_rad


def arc(drive, floor, radius_m, angle_rad, step_m):
    count = max(2, round(radius_m * angle_rad / step_m)) + 1
    turned = np.linspace(0, angle_rad, count)
    path = np.column_stack([3.0 + radius_m * np.sin(turned), 1.0 + radius_m * (1 - np.cos(turned))])
    return drive(floor(8.0, 8.0), path, step_m=1.0, heading_rad=turned)


@pytest.mark.parametrize("step_m", [0.02, 0.05])
def test_on_an_arc_the_total_is_its_angle_and_the_sharpest_is_half_a_metre_of_it(drive, floor, step_m):
    trajectory = arc(drive, floor, 1.5, np.pi, step_m)
    assert total_turning_rad(trajectory) == pytest.approx(np.pi)
    # whole frames: up to one step of the way is missing from the half metre, and chords are shorter than the arc
    assert sharpest_turn_rad(trajectory) == pytest.approx(SHARP_TURN_M / 1.5, abs=1.1 * step_m / 1.5)


def test_the_tighter_the_arc_the_sharper_the_turn(drive, floor):
    found = [sharpest_turn_rad(arc(drive, floor, radius_m, 2.0, 0.02)) for radius_m in (3.0, 2.0, 1.0, 0.5)]
    assert found == sorted(found)


def test_turning_on_the_spot_counts_in_full(drive, floor):
    path = np.full((50, 2), 2.0)
    trajectory = drive(floor(6.0, 6.0), path, heading_rad=np.linspace(0, 3 * np.pi, 50), goal_xy_m=(4.0, 4.0))
    assert total_turning_rad(trajectory) == pytest.approx(3 * np.pi)
    assert sharpest_turn_rad(trajectory) == pytest.approx(3 * np.pi)


def test_left_and_right_do_not_cancel_in_the_total(drive, floor):
    trajectory = drive(floor(6.0, 6.0), [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (3.0, 2.0)])
    assert total_turning_rad(trajectory) == pytest.approx(np.pi)


@given(seed=st.integers(0, 1000))
def test_the_sharpest_turn_is_the_greatest_of_all_pairs_within_half_a_metre(drive_for_given, seed):
    rng = np.random.default_rng(seed)
    steps, headings = rng.uniform(0, 0.3, size=30), rng.uniform(-0.5, 0.5, size=31).cumsum()
    trajectory = drive_for_given(np.concatenate([[0.0], steps.cumsum()]), headings)
    gone = np.concatenate([[0.0], np.cumsum(trajectory.steps_m)])
    pairs = [
        abs(headings[i] - headings[j]) for i in range(31) for j in range(31) if abs(gone[i] - gone[j]) <= SHARP_TURN_M
    ]
    assert sharpest_turn_rad(trajectory) == pytest.approx(max(pairs), abs=1e-9)
