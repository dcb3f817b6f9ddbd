import numpy as np
import pytest

from wsm_data.curation.scorers.clearance import least_clearance_m, tight_share
from wsm_data.curation.scorers.trajectory import CLEARANCE_CAP_M


def past_a_box(drive, floor, gap_m):
    """A straight way of 6 m in a wide room, past a box of 0.4 m in the middle at a gap."""
    return drive(floor(8.0, 6.0, [(3.8, 3.0 + gap_m, 4.2, 3.4 + gap_m)]), [(1.0, 3.0), (7.0, 3.0)], step_m=0.01)


@pytest.mark.parametrize("gap_m", [0.3, 0.35, 0.45])
def test_past_a_box_it_is_the_gap_and_the_tight_stretch_follows_from_pythagoras(drive, floor, gap_m):
    trajectory = past_a_box(drive, floor, gap_m)
    assert least_clearance_m(trajectory) == pytest.approx(gap_m, abs=1e-9)
    tight_m = 0.4 + 2 * np.sqrt(0.5**2 - gap_m**2)
    assert tight_share(trajectory) == pytest.approx(tight_m / 6.0, abs=2 * 0.01 / 6.0)  # two ends, a step each


def test_a_nearer_box_makes_both_harder(drive, floor):
    trajectories = [past_a_box(drive, floor, gap_m) for gap_m in (0.8, 0.6, 0.45, 0.35, 0.3)]
    least, share = [least_clearance_m(one) for one in trajectories], [tight_share(one) for one in trajectories]
    assert least == sorted(least, reverse=True)
    assert share == sorted(share)
    assert share[:2] == [0.0, 0.0]


def test_a_share_is_of_the_way_and_not_of_the_frames(drive, floor):
    grid = floor(8.0, 6.0, [(3.0, 3.3, 5.0, 3.5)])
    way = np.concatenate([np.linspace([1.0, 3.0], [3.0, 3.0], 200), np.linspace([3.0, 3.0], [7.0, 3.0], 100)[1:]])
    even = drive(grid, [(1.0, 3.0), (7.0, 3.0)], step_m=0.01)
    assert tight_share(drive(grid, way, step_m=1.0)) == pytest.approx(tight_share(even), abs=0.04 / 6.0)


def test_in_the_open_clearance_is_not_told_apart(drive, floor):
    assert least_clearance_m(drive(floor(20.0, 20.0), [(9.0, 10.0), (11.0, 10.0)])) == CLEARANCE_CAP_M
