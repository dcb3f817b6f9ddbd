import numpy as np
import pytest

from wsm_data.checks.reachability import check_goal_reachable
from wsm_data.errors import Reason


def test_a_goal_with_a_way_to_it_is_kept():
    assert check_goal_reachable(np.array([4.2, 2.0, 0.0]), "a").measured == {"start_distance_m": 4.2}


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_a_goal_without_a_way_is_unreachable(value):
    verdict = check_goal_reachable(np.array([4.2, value, 0.0]), "a")
    assert (verdict.reason, verdict.measured) == (Reason.GOAL_UNREACHABLE, {"frame": 1, "frames": 1})
