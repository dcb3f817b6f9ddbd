import dataclasses

import pytest

from wsm_data.view.clip.facts import clip_facts
from wsm_data.view.release.distributions import clip_distributions


def test_every_distribution_has_a_unit_and_one_value_per_clip(clip):
    facts = clip_facts(clip)
    shown = clip_distributions([facts, facts])
    assert len(shown) == 10
    for one in shown:
        assert one.label.endswith(")")
        assert len(one.values) == 2
        assert one.missing == 0


def test_clips_without_a_number_are_counted_as_missing(clip):
    facts = clip_facts(clip)
    without = dataclasses.replace(facts, detour=None)
    detour = next(one for one in clip_distributions([facts, without, without]) if one.title == "Detour")
    assert detour.values == (facts.detour,)
    assert detour.missing == 2


def test_shares_are_marked_as_shares(clip):
    shares = {one.title for one in clip_distributions([clip_facts(clip)]) if one.share}
    assert shares == {"Depth measured", "Unknown map"}


@pytest.mark.parametrize("one", clip_distributions([]), ids=lambda one: one.title)
def test_no_clip_gives_empty_distributions(one):
    assert one.values == ()
