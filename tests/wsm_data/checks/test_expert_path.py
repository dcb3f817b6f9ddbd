import numpy as np
import pytest

from wsm_data.checks.expert_path import check_expert_path
from wsm_data.errors import Reason


def test_a_path_with_room_is_kept():
    verdict = check_expert_path(np.array([0.5, 0.21, 0.3]), "a", 0.10)
    assert verdict.keep
    assert verdict.measured == {"min_clearance_m": 0.21, "median_clearance_m": 0.3}


@pytest.mark.parametrize("nearest", [0.0, 0.05, 0.0999])
def test_a_path_through_an_obstacle_is_refused_at_its_nearest_frame(nearest):
    verdict = check_expert_path(np.array([0.5, 0.09999, nearest, 0.3]), "a", 0.10)
    assert verdict.reason is Reason.PATH_THROUGH_OBSTACLE
    assert (verdict.measured["frame"], verdict.measured["frames"]) == (2, 2)


def test_a_clearance_that_is_no_number_is_refused():
    assert not check_expert_path(np.array([0.5, np.nan]), "a", 0.10).keep


def test_a_map_without_obstacles_gives_endless_room():
    assert check_expert_path(np.array([np.inf, np.inf]), "a", 0.10).keep
