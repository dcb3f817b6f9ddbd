from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.mixing import mixed_refs, source_stretch, stretch_of_epoch
from wsm_data.loaders.order.pass_order import SourceLayout, pass_order

WEIGHTS = st.sampled_from([0.1, 0.25, 0.3, 0.5, 1.0, 1.5, 2.0, 2.4])


def layout(clips: int, weight: float = 1.0) -> SourceLayout:
    shard_clips = np.full(-(-clips // 4), 4)
    shard_clips[-1] -= shard_clips.sum() - clips
    return SourceLayout(shard_clips=shard_clips, latents=np.ones(clips, np.int32), weight=weight)


@given(st.integers(1, 40), WEIGHTS, st.integers(0, 12))
def test_stretches_of_consecutive_epochs_join(clips: int, weight: float, epoch: int) -> None:
    first, last = stretch_of_epoch(clips, weight, epoch)
    assert stretch_of_epoch(clips, weight, epoch + 1)[0] == last
    assert abs(last - first - weight * clips) <= 1  # both ends are rounded by half a clip at most


@given(st.integers(1, 40), WEIGHTS)
def test_twenty_epochs_bring_every_clip_as_often_as_the_weight_says(clips: int, weight: float) -> None:
    order = OrderConfig(seed=1)
    seen = [source_stretch(layout(clips, weight), order, source=0, epoch=epoch) for epoch in range(20)]
    counts = np.bincount(np.concatenate(seen), minlength=clips)
    assert counts.tolist() == [round(20 * weight)] * clips  # twenty times each of the weights is whole


@given(st.integers(1, 30), WEIGHTS, st.integers(0, 9))
def test_a_stretch_is_cut_from_the_endless_sequence_of_passes(clips: int, weight: float, epoch: int) -> None:
    order, own = OrderConfig(seed=2), layout(clips, weight)
    endless = np.concatenate([pass_order(own.shard_clips, order, source=3, number=number) for number in range(26)])
    first, last = stretch_of_epoch(clips, weight, epoch)
    np.testing.assert_array_equal(source_stretch(own, order, source=3, epoch=epoch), endless[first:last])


def test_a_weight_is_the_decimal_that_was_written() -> None:
    """As a binary number 0.1 is a little more than a tenth: after 10,000,000 epochs it would have drifted by a clip."""
    assert stretch_of_epoch(10**9, 0.1, 10**7)[0] == 10**15


@given(st.lists(st.tuples(st.integers(1, 20), WEIGHTS), min_size=1, max_size=4), st.integers(0, 5))
def test_sources_are_mixed_each_in_its_own_order(parts: list[tuple[int, float]], epoch: int) -> None:
    layouts = [layout(clips, weight) for clips, weight in parts]
    order = OrderConfig(seed=4)
    refs = mixed_refs(layouts, order, epoch)
    bases = np.cumsum([0, *(clips for clips, _ in parts)])
    for source, own in enumerate(layouts):
        of_source = refs[(refs >= bases[source]) & (refs < bases[source + 1])] - bases[source]
        np.testing.assert_array_equal(of_source, source_stretch(own, order, source=source, epoch=epoch))


@given(st.lists(st.integers(1, 60), min_size=2, max_size=4))
def test_every_part_of_an_epoch_has_the_same_shares(sizes: list[int]) -> None:
    layouts = [layout(clips) for clips in sizes]
    refs = mixed_refs(layouts, OrderConfig(), 0)
    owner = np.searchsorted(np.cumsum(sizes), refs, side="right")
    for source, size in enumerate(sizes):
        so_far = np.cumsum(owner == source)
        expected = np.arange(1, len(refs) + 1) * size / len(refs)
        assert abs(so_far - expected).max() <= len(sizes)  # each source is off by its rounding to whole clips


def test_clips_at_the_same_place_come_by_source() -> None:
    assert mixed_refs([layout(2), layout(2)], OrderConfig(shuffle=False), 0).tolist() == [0, 2, 1, 3]


@pytest.mark.parametrize("epoch", range(4))
def test_a_source_of_a_small_weight_may_leave_an_epoch_out(epoch: int) -> None:
    counts = Counter(mixed_refs([layout(4), layout(1, 0.5)], OrderConfig(), epoch).tolist())
    assert counts[4] == stretch_of_epoch(1, 0.5, epoch)[1] - stretch_of_epoch(1, 0.5, epoch)[0]
