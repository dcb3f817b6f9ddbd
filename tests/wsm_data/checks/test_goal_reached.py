from wsm_data.checks.goal_reached import check_goal_reached
from wsm_data.errors import Reason


def test_an_expert_that_ends_in_the_goal_region_is_kept_with_its_distance():
    verdict = check_goal_reached(0.0, 0.2, "one")
    assert verdict.keep
    assert verdict.measured == {"last_distance_m": 0.0, "goal_radius_m": 0.2}


def test_one_that_ends_elsewhere_is_refused_with_the_distance_and_what_to_do():
    verdict = check_goal_reached(0.75, 0.2, "one")
    assert verdict.reason is Reason.GOAL_NOT_REACHED
    assert "ends 0.75 m away" in verdict.message
    assert "encode.clip.goal_radius_m" in verdict.message
