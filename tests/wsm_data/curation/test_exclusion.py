import numpy as np
import pytest

from wsm_data.curation.exclusion import ExclusionConfig, excluded_clips
from wsm_data.errors import ConfigError

ALL = np.arange(4)
RULE = ("detour",)


def test_clips_without_a_way_and_clips_that_nobody_gets_right_are_hopeless(make_scores):
    scores = make_scores(goal_reachable=[1, 0, 1, 1], rollout_all_unsafe=[0, 0, 1, np.nan])
    found = excluded_clips(scores, ExclusionConfig(), RULE, ALL)
    assert found.clips.tolist() == [False, True, True, False]
    assert found.counts == {"goal_reachable at most 0": 1, "rollout_all_unsafe at least 1": 1}


def test_the_hopeless_stay_where_that_is_asked_for(make_scores):
    scores = make_scores(goal_reachable=[1, 0, 1, 1])
    assert not excluded_clips(scores, ExclusionConfig(hopeless=False), RULE, ALL).clips.any()


def test_without_rollouts_clips_are_judged_by_the_map_alone(make_scores):
    assert ExclusionConfig().scores(make_scores(goal_reachable=[1], other=[2]).scorers) == ("goal_reachable",)
    assert ExclusionConfig().scores(make_scores(other=[2]).scorers) == ()


def test_bounds_of_the_user_leave_out_both_ends(make_scores):
    scores = make_scores(detour=[1, 2, 3, np.nan], ease_m=[1, 2, 3, 4])
    config = ExclusionConfig(at_least={"detour": 3.0}, at_most={"ease_m": 1.0})
    assert excluded_clips(scores, config, RULE, ALL).clips.tolist() == [True, False, True, False]
    assert excluded_clips(scores, config, RULE, np.array([2, 1])).clips.tolist() == [True, False]


def test_a_bound_on_an_unknown_score_is_refused_by_its_name(make_scores):
    with pytest.raises(ConfigError, match=r"'detuor'.*did you mean detour"):
        excluded_clips(make_scores(detour=[1, 2, 3, 4]), ExclusionConfig(at_most={"detuor": 1.0}), RULE, ALL)


def test_a_clip_with_several_reasons_counts_under_the_first(make_scores):
    scores = make_scores(
        goal_reachable=[1, 0, 1, 1], rollout_all_unsafe=[0, 1, 1, np.nan], detour=[np.nan, np.nan, 1, 1]
    )
    found = excluded_clips(scores, ExclusionConfig(unscored=True), RULE, ALL)
    assert found.counts == {
        "goal_reachable at most 0": 1,
        "rollout_all_unsafe at least 1": 1,
        "having no score of the rule": 1,
    }
    assert found.clips.tolist() == [True, True, True, False]


def test_clips_that_have_one_score_of_the_rule_are_scored(make_scores):
    scores = make_scores(detour=[1, np.nan, np.nan, 2], cost=[np.nan, 1, np.nan, 2])
    found = excluded_clips(scores, ExclusionConfig(unscored=True), ("detour", "cost"), ALL)
    assert found.clips.tolist() == [False, False, True, False]


@pytest.mark.parametrize("bound", [float("nan"), float("inf"), -float("inf")])
def test_a_bound_that_is_no_number_is_refused_by_its_name(bound):
    with pytest.raises(ValueError, match=r"at_most\.detour must be a finite number"):
        ExclusionConfig(at_most={"detour": bound})
