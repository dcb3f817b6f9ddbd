import numpy as np
import pytest

from wsm_data.curation.quotas import Limits, Quota, QuotaConfig
from wsm_data.curation.rule import RuleConfig
from wsm_data.curation.select import SelectionConfig, select_clips
from wsm_data.curation.stability import bootstrap_overlap, jaccard


@pytest.mark.parametrize(("a", "b", "overlap"), [([1, 2], [2, 3], 1 / 3), ([1], [1], 1), ([1], [2], 0), ([], [], 1)])
def test_the_jaccard_index_is_common_clips_over_clips_in_either(a, b, overlap):
    assert jaccard(np.array(a, int), np.array(b, int)) == pytest.approx(overlap)


@pytest.fixture
def overlap(make_scores, make_index, far_paths):
    scores = make_scores(detour=np.random.default_rng(0).normal(size=200))
    index = make_index(["a/zed" if number % 40 else "b/d435i" for number in range(200)])

    def go(samples=6, **changes):
        config = SelectionConfig(rule=RuleConfig(weights={"detour": 1.0}), **changes)
        chosen = select_clips(index, scores, far_paths.read, config).rows
        return bootstrap_overlap(index, scores, far_paths.read, config, chosen, samples=samples)

    return go


def test_a_rule_by_one_score_hangs_little_on_the_sample(overlap):
    """The hardest tenth of a sample is the hardest tenth of the whole but for the rounding of its size."""
    found = overlap()
    assert len(found.jaccard) == 6
    assert min(found.jaccard) > 0.6


def test_samples_are_the_same_every_time_and_differ_from_one_another(overlap):
    first = overlap(samples=12)
    assert overlap(samples=12) == first
    assert len(set(first.jaccard)) > 1


def test_samples_in_which_quotas_cannot_be_met_are_counted(overlap):
    """All five clips of one camera must be chosen, and one sample in ten has all of them."""
    found = overlap(quotas=QuotaConfig(camera=Quota(named={"d435i": Limits(at_least=5)})))
    assert (found.unmet, len(found.jaccard)) == (5, 1)
