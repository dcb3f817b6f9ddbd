import numpy as np
import pytest

from wsm_data.curation.exclusion import ExclusionConfig, excluded_clips
from wsm_data.errors import ConfigError

ALL = np.arange(4)


def test_clips_without_a_way_and_clips_that_nobody_gets_right_are_hopeless(make_scores):
    scores = make_scores(goal_reachable=[1, 0, 1, 1], rollout_all_unsafe=[0, 0, 1, np.nan])
    found = excluded_clips(scores, ExclusionConfig(), ALL)
    assert found.clips.tolist() == [False, True, True, False]
    assert found.counts == {"goal_reachable at most 0": 1, "rollout_all_unsafe at least 1": 1}


def test_the_hopeless_stay_where_that_is_asked_for(make_scores):
    scores = make_scores(goal_reachable=[1, 0, 1, 1])
    assert not excluded_clips(scores, ExclusionConfig(hopeless=False), ALL).clips.any()


def test_without_rollouts_clips_are_judged_by_the_map_alone(make_scores):
    assert ExclusionConfig().scores(make_scores(goal_reachable=[1], other=[2]).scorers) == ("goal_reachable",)
    assert ExclusionConfig().scores(make_scores(other=[2]).scorers) == ()


def test_bounds_of_the_user_leave_out_both_ends(make_scores):
    scores = make_scores(detour=[1, 2, 3, np.nan], ease_m=[1, 2, 3, 4])
    config = ExclusionConfig(at_least={"detour": 3.0}, at_most={"ease_m": 1.0})
    assert excluded_clips(scores, config, ALL).clips.tolist() == [True, False, True, False]
    assert excluded_clips(scores, config, np.array([2, 1])).clips.tolist() == [True, False]


def test_a_bound_on_an_unknown_score_is_refused_by_its_name(make_scores):
    with pytest.raises(ConfigError, match=r"'detuor'.*did you mean detour"):
        excluded_clips(make_scores(detour=[1, 2, 3, 4]), ExclusionConfig(at_most={"detuor": 1.0}), ALL)
