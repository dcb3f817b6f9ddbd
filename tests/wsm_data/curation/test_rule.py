import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.rule import GEOMETRY_WEIGHTS, RuleConfig, RuleKind, hardness_percentiles, rate_clips
from wsm_data.curation.score_clip import CLIP_SCORES
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable
from wsm_data.errors import ConfigError

VALUES = st.lists(st.one_of(st.integers(-3, 3).map(float), st.just(np.nan)), min_size=1, max_size=30)


def weighted(**weights):
    return RuleConfig(weights=weights, emphasis=1)


def lexicographic(*order):
    return RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=order)


def slow_percentiles(values, direction):
    """For each value, the share of known ones that are easier and half the share of equal ones, itself among them."""
    known = [one for one in values if not np.isnan(one)]
    sign = -1 if direction is Direction.LOWER else 1
    return [
        np.nan
        if np.isnan(one)
        else (sum(sign * other < sign * one for other in known) + sum(other == one for other in known) / 2) / len(known)
        for one in values
    ]


@given(VALUES, st.sampled_from([Direction.HIGHER, Direction.LOWER]))
def test_percentiles_are_the_share_of_easier_clips(values, direction):
    found = hardness_percentiles(np.array(values), direction)
    np.testing.assert_allclose(found, slow_percentiles(values, direction), atol=1e-12)  # sums of thirtieths


@given(VALUES)
def test_percentiles_do_not_change_under_a_monotone_change_of_the_unit(values):
    numbers = np.array(values)
    np.testing.assert_array_equal(
        hardness_percentiles(numbers, Direction.HIGHER), hardness_percentiles(np.exp(numbers) * 7, Direction.HIGHER)
    )


def test_a_weighted_rule_is_the_mean_of_the_percentiles_with_the_hard_end_of_each_score_up(make_scores):
    scores = make_scores(detour=[1, 2, 3, 4], ease_m=[0.1, 0.4, 0.3, 0.2])
    rating = rate_clips(scores, weighted(detour=3.0, ease_m=1.0))
    detour, ease = np.array([1, 3, 5, 7]) / 8, np.array([7, 1, 3, 5]) / 8
    np.testing.assert_allclose(rating.difficulty, (3 * detour + ease) / 4)
    np.testing.assert_allclose(rating.percentiles["ease_m"], ease)


@given(VALUES.filter(lambda values: not np.isnan(values).any()), st.sampled_from([1, 2, 4, 16]))
def test_with_emphasis_a_clip_is_rated_between_its_plain_mean_and_its_hardest_score(values, emphasis):
    columns = {"a": np.array(values), "b": -np.array(values), "c": np.zeros(len(values))}
    infos = tuple(ScorerInfo(name=one, unit="m", direction=Direction.HIGHER, summary="") for one in columns)
    scores = ScoreTable(
        release_digest="d",
        scorers=infos,
        keys=pa.array([str(number) for number in range(len(values))]),
        columns=columns,
    )
    weights = {"a": 1.0, "b": 2.0, "c": 0.5}
    plain, found = (rate_clips(scores, RuleConfig(weights=weights, emphasis=one)) for one in (1, emphasis))
    ranks = np.stack([found.percentiles[name] for name in weights]).astype(float)
    expected = (np.array([1.0, 2.0, 0.5]) @ ranks**emphasis / 3.5) ** (1 / emphasis)
    np.testing.assert_allclose(found.difficulty, expected, rtol=1e-6)  # percentiles are given as float32
    assert (found.difficulty >= plain.difficulty - 1e-12).all()
    assert (found.difficulty <= ranks.max(axis=0) + 1e-6).all()


@pytest.mark.parametrize("emphasis", [0, 3, -1, 128])
def test_an_emphasis_that_is_no_mean_is_refused(emphasis):
    with pytest.raises(ValueError, match="emphasis must be one of 1, 2, 4, 8"):
        RuleConfig(emphasis=emphasis)


def test_a_score_that_a_clip_does_not_have_is_left_out_of_its_mean(make_scores):
    scores = make_scores(detour=[1, 2, 3], retreat=[np.nan, 5, 4])
    rating = rate_clips(scores, weighted(detour=1.0, retreat=1.0))
    np.testing.assert_allclose(rating.difficulty, [1 / 6, (1 / 2 + 3 / 4) / 2, (5 / 6 + 1 / 4) / 2])


def test_clips_are_rated_against_the_given_rows_alone(make_scores):
    scores = make_scores(detour=[9, 1, 2, 8])
    np.testing.assert_allclose(rate_clips(scores, weighted(detour=1.0), np.array([2, 1])).difficulty, [3 / 4, 1 / 4])


def test_a_lexicographic_rule_goes_by_the_first_score_and_by_the_second_among_equals(make_scores):
    scores = make_scores(unsafe=[0.5, 1.0, 0.5, 0.0, 0.5], cost=[1, 0, 2, 9, 2])
    rating = rate_clips(scores, lexicographic("unsafe", "cost"))
    np.testing.assert_allclose(rating.difficulty, np.array([1.5, 4.5, 3.0, 0.5, 3.0]) / 5)


def test_in_a_lexicographic_rule_a_clip_without_the_first_score_comes_last(make_scores):
    scores = make_scores(unsafe=[np.nan, 0.0, 0.2], cost=[9, 1, 1])
    assert np.argsort(rate_clips(scores, lexicographic("unsafe", "cost")).difficulty).tolist() == [0, 1, 2]


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=1, max_size=20))
def test_a_lexicographic_rule_orders_as_pairs_do(pairs):
    from wsm_data.curation.rule import _lexicographic

    ranks = [hardness_percentiles(np.array(column, float), Direction.HIGHER) for column in zip(*pairs, strict=True)]
    difficulty = _lexicographic(ranks)
    for one, hard in zip(pairs, difficulty, strict=True):
        for other, other_hard in zip(pairs, difficulty, strict=True):
            assert (one < other) == (hard < other_hard)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (weighted(detuor=1.0), "'detuor'.*did you mean detour"),
        (lexicographic("rollout_unsafe_share"), "rollout_unsafe_share.*evaluate a policy first"),
        (weighted(goal_reachable=1.0), "goal_reachable.*no hard end"),
    ],
)
def test_a_rule_by_an_unknown_or_neutral_score_is_refused_by_its_name(make_scores, rule, message):
    with pytest.raises(ConfigError, match=message):
        rate_clips(make_scores(detour=[1, 2], goal_reachable=[1, 1]), rule)


def test_a_clip_without_any_score_of_the_rule_is_named(make_scores):
    with pytest.raises(ConfigError, match=r"1 clips have none of the scores.*g_d435i/s/000001"):
        rate_clips(make_scores(detour=[1, np.nan, 3]), weighted(detour=1.0))


@pytest.mark.parametrize("weight", [0.0, -1.0, np.nan, np.inf])
def test_a_weight_must_be_a_number_above_0(weight):
    with pytest.raises(ValueError, match=r"weights\.detour must be a number above 0"):
        weighted(detour=weight)


def test_a_rule_needs_scores_and_names_none_twice():
    with pytest.raises(ValueError, match="at least one score"):
        RuleConfig(weights={})
    with pytest.raises(ValueError, match="name a score once"):
        lexicographic("a", "a")


def test_the_default_rule_goes_by_scores_that_every_release_has():
    directions = {one.name: one.direction for one in CLIP_SCORES}
    assert all(directions[name] is not Direction.NEUTRAL for name in GEOMETRY_WEIGHTS)
