import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.exclusion import ExclusionConfig
from wsm_data.curation.key_order import key_hashes
from wsm_data.curation.quotas import Quota, QuotaConfig
from wsm_data.curation.rule import RuleConfig, RuleKind, rate_clips
from wsm_data.curation.score_clip import CLIP_SCORES, score_clip
from wsm_data.curation.scores_table import ScoreTable
from wsm_data.curation.select import SelectionConfig, explained_scores, hardest_first, select_clips
from wsm_data.errors import ConfigError

RULE = RuleConfig(weights={"detour": 1.0})


@pytest.fixture
def select(make_index, far_paths):
    def go(scores, places=None, splits=None, **changes):
        index = make_index(places or ["a/zed"] * len(scores), splits)
        return select_clips(index, scores, far_paths.read, SelectionConfig(**{"rule": RULE, **changes}))

    return go


def test_the_hardest_tenth_of_the_split_is_chosen_hardest_first(select, make_scores):
    detour = np.random.default_rng(0).permutation(40).astype(float)
    splits = ["test" if value >= 30 else "train" for value in detour]
    found = select(make_scores(detour=detour), splits=splits)
    assert detour[found.rows].tolist() == [29, 28, 27]
    assert found.trajectories == 30
    np.testing.assert_allclose(found.difficulty, np.array([29.5, 28.5, 27.5]) / 30)
    assert found.why[0].as_py() == "detour 29 (98th percentile)"


@pytest.mark.parametrize(("fraction", "count"), [(0.001, 1), (0.149, 1), (0.15, 2), (0.5, 5), (1.0, 10)])
def test_the_fraction_is_rounded_to_a_number_of_clips_and_one_at_least(select, make_scores, fraction, count):
    assert len(select(make_scores(detour=range(10)), fraction=fraction).rows) == count


def test_equals_are_ordered_by_the_hash_of_their_key_and_not_by_their_place(select, make_scores, make_index, far_paths):
    scores = make_scores(detour=[1.0] * 100)
    found = select(scores)
    assert found.rows.tolist() == np.argsort(key_hashes(scores.keys))[:10].tolist()


def test_the_order_of_the_index_does_not_change_which_clips_are_chosen(make_scores, make_index, far_paths):
    rng = np.random.default_rng(1)
    scores = make_scores(detour=rng.integers(0, 5, 60))
    index = make_index([f"{'abc'[n % 3]}/{'zed' if n % 2 else 'd435i'}" for n in range(60)])
    config = SelectionConfig(rule=RULE, fraction=0.3, quotas=QuotaConfig(scene=Quota(at_most=0.5)))
    order = rng.permutation(60)
    shuffled = type(scores)(
        release_digest="d1", scorers=scores.scorers, keys=scores.keys.take(pa.array(order)),
        columns={"detour": scores.columns["detour"][order]},
    )  # fmt: skip
    first = select_clips(index, scores, far_paths.read, config)
    second = select_clips(index.take(pa.array(order)), shuffled, lambda rows: far_paths.read(order[rows]), config)
    assert order[second.rows].tolist() == first.rows.tolist()
    assert second.why.to_pylist() == first.why.to_pylist()


def test_excluded_clips_are_not_chosen_and_count_as_trajectories(select, make_scores):
    scores = make_scores(detour=range(20), goal_reachable=[1.0] * 19 + [0.0])
    found = select(scores)
    assert found.rows.tolist() == [18, 17]
    assert (found.trajectories, found.excluded) == (20, {"goal_reachable at most 0": 1})


def test_a_clip_whose_path_leads_through_a_wall_is_excluded(select, hall_clip):
    scored = [score_clip(hall_clip(number, walled=number == 2), np.ones(48), None, 0).values for number in range(4)]
    columns = {one.name: np.array([values[one.name] for values in scored]) for one in CLIP_SCORES}
    keys = pa.array([f"k{number}" for number in range(4)])
    scores = ScoreTable(release_digest="d1", scorers=CLIP_SCORES, keys=keys, columns=columns)
    found = select(scores, fraction=0.75, rule=RuleConfig(), places=["a/zed"] * 4)
    assert sorted(found.rows.tolist()) == [0, 1, 3]
    assert found.excluded["goal_reachable at most 0"] == 1


def test_clips_without_a_score_are_left_out_where_that_is_asked_for(select, make_scores):
    rule = RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=("unsafe", "cost"))
    scores = make_scores(unsafe=[0.5, np.nan, np.nan, np.nan], cost=[np.nan, np.nan, 1.0, np.nan])
    with pytest.raises(ConfigError, match=r"2 clips have none of the scores .*exclude\.unscored=true"):
        select(scores, rule=rule, fraction=0.5)
    found = select(scores, rule=rule, fraction=0.5, exclude=ExclusionConfig(unscored=True))
    assert found.rows.tolist() == [0, 2]
    assert found.excluded == {"having no score of the rule": 2}


def test_a_rule_by_scores_that_are_not_there_is_refused_with_what_to_do(make_scores):
    config = SelectionConfig(rule=RuleConfig(kind=RuleKind.LEXICOGRAPHIC))
    with pytest.raises(ConfigError, match=r"'rollout_unsafe_share'.*evaluate a policy first"):
        config.score_names(make_scores(detour=[1]).scorers)


def test_a_lexicographic_rule_is_explained_in_its_order(select, make_scores):
    rule = RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=("unsafe", "cost"))
    found = select(make_scores(unsafe=[0.0, 1.0, 1.0], cost=[9, 2, 3]), rule=rule, fraction=0.6)
    assert found.rows.tolist() == [2, 1]
    assert found.why.to_pylist()[0] == "unsafe 1 (66th percentile); cost 3 (50th percentile)"


def test_paths_are_asked_for_by_their_rows_in_the_index(select, make_scores, far_paths):
    splits = ["test"] * 5 + ["train"] * 5
    select(make_scores(detour=range(10)), splits=splits, fraction=0.2)
    assert set(far_paths.asked) == {5, 6, 7, 8, 9}


def test_without_diversity_no_path_is_read(select, make_scores, far_paths):
    select(make_scores(detour=range(10)), diversity=DiversityConfig(within_m=0.0))
    assert far_paths.asked == []


@pytest.mark.parametrize("fraction", [0.0, -0.1, 1.01, float("nan")])
def test_a_fraction_of_0_or_above_1_is_refused(fraction):
    with pytest.raises(ValueError, match="fraction must be above 0 and at most 1"):
        SelectionConfig(fraction=fraction)


def test_a_split_without_clips_is_refused_by_its_name(select, make_scores):
    with pytest.raises(ConfigError, match="no clip of the split 'validation'"):
        select(make_scores(detour=[1.0]), split="validation")


def test_an_exclusion_that_leaves_too_few_is_refused_with_its_reasons(select, make_scores):
    exclude = ExclusionConfig(at_least={"detour": 3.0})
    with pytest.raises(ConfigError, match=r"asks for 5 clips, and 3 are left; excluded are 7 by detour at least 3"):
        select(make_scores(detour=range(10)), fraction=0.5, exclude=exclude)


def test_the_scores_that_are_read_are_those_of_rule_and_exclusion(make_scores):
    config = SelectionConfig(rule=RULE, exclude=ExclusionConfig(at_most={"ease_m": 0.1}))
    scorers = make_scores(detour=[1], ease_m=[1], other=[1], goal_reachable=[1]).scorers
    assert config.score_names(scorers) == ("detour", "goal_reachable", "ease_m")


def test_explained_scores_are_those_of_the_clips_in_question(make_scores):
    scores = make_scores(detour=[5, 1, 9, 3])
    rows = np.array([3, 0, 2])
    rating = rate_clips(scores, RULE, rows)
    [found] = explained_scores(scores, RULE, rating, rows, np.array([2, 0]))
    assert (found.values.tolist(), found.weight) == ([9, 3], 1.0)
    np.testing.assert_allclose(found.percentiles, [5 / 6, 1 / 6], rtol=1e-6)  # float32


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), max_size=30))
def test_the_walk_is_that_of_a_sort_by_difficulty_and_hash(pairs):
    difficulty = np.array([pair[0] for pair in pairs], np.float64)
    hashes = np.array([pair[1] for pair in pairs], np.uint64)
    assert hardest_first(difficulty, hashes).tolist() == np.lexsort((hashes, -difficulty)).tolist()
