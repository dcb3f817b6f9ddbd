from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder
from wsm_data.loaders.order.epoch_order import EpochOrder, chunk_sizes, order_epoch, rows_per_rank
from wsm_data.loaders.order.mixing import mixed_refs
from wsm_data.loaders.order.pass_order import SourceLayout

LONGEST = 9
WORLD_SIZES = (1, 2, 3, 4, 6)


@st.composite
def layouts(draw: st.DrawFn) -> list[SourceLayout]:
    sources = []
    for number in range(draw(st.integers(1, 3))):
        shard_clips = draw(st.lists(st.integers(1, 15), min_size=1, max_size=6))
        latents = draw(st.lists(st.integers(1, LONGEST), min_size=sum(shard_clips), max_size=sum(shard_clips)))
        weight = draw(st.sampled_from([0.5, 1.0, 2.0] if number else [1.0, 1.5]))  # no epoch is empty
        sources.append(
            SourceLayout(shard_clips=np.array(shard_clips), latents=np.array(latents, np.int32), weight=weight)
        )
    return sources


@st.composite
def orders(draw: st.DrawFn, remainder: Sequence[Remainder] = tuple(Remainder)) -> OrderConfig:
    arrangement = draw(st.sampled_from(Arrangement))
    return OrderConfig(
        seed=draw(st.integers(0, 3)),
        shuffle=draw(st.booleans()),
        block_clips=draw(st.integers(0, 4)),
        window_blocks=draw(st.integers(1, 4)),
        global_batch=draw(st.sampled_from([1, 12])),
        remainder=draw(st.sampled_from(remainder)),
        max_latents=draw(st.sampled_from([0, 5])),
        arrangement=arrangement,
        pool=draw(st.integers(1, 5)),
        row_latents=LONGEST if arrangement is Arrangement.JOIN else 0,
    )


WITHOUT_DROP = orders(remainder=(Remainder.REPEAT, Remainder.PAD))


def one_source(clips: int = 50, latents: int = 4, weight: float = 1.0) -> list[SourceLayout]:
    return [SourceLayout(shard_clips=np.array([clips]), latents=np.full(clips, latents, np.int32), weight=weight)]


def rows_of(epoch_order: EpochOrder, world_size: int = 1) -> list[list[list[list[int]]]]:
    """Refs by step, rank and row."""
    return [
        [[row.tolist() for row in epoch_order.rows(step, rank, world_size)] for rank in range(world_size)]
        for step in range(epoch_order.steps)
    ]


@given(layouts(), WITHOUT_DROP, st.integers(0, 3))
def test_ranks_together_have_the_same_rows_in_the_same_order(
    sources: list[SourceLayout], order: OrderConfig, epoch: int
) -> None:
    epoch_order = order_epoch(sources, replace(order, global_batch=12), epoch)
    wanted = [ranks[0] for ranks in rows_of(epoch_order)]
    for world_size in WORLD_SIZES:
        steps = rows_of(epoch_order, world_size)
        assert [[row for rank in ranks for row in rank] for ranks in steps] == wanted
        assert {len(rank) for ranks in steps for rank in ranks} == {12 // world_size}


@given(layouts(), WITHOUT_DROP, st.integers(0, 3))
def test_an_epoch_brings_what_the_sources_give_to_it(
    sources: list[SourceLayout], order: OrderConfig, epoch: int
) -> None:
    epoch_order = order_epoch(sources, order, epoch)
    wanted = Counter(mixed_refs(sources, order, epoch).tolist())
    found = Counter(ref for ranks in rows_of(epoch_order) for row in ranks[0] for ref in row)
    if order.remainder is Remainder.PAD:
        assert found == wanted
    assert found.keys() == wanted.keys()
    assert sum((found - wanted).values()) >= epoch_order.summary.repeated_rows  # a repeated row has at least one clip
    assert not wanted - found


@given(layouts(), orders(remainder=(Remainder.DROP,)), st.integers(0, 3))
def test_drop_leaves_out_fewer_rows_than_a_step_has(
    sources: list[SourceLayout], order: OrderConfig, epoch: int
) -> None:
    wanted = Counter(mixed_refs(sources, order, epoch).tolist())
    try:
        epoch_order = order_epoch(sources, order, epoch)
    except ConfigError:
        assert sum(wanted.values()) < order.global_batch or order.arrangement is Arrangement.JOIN
        return
    found = Counter(ref for ranks in rows_of(epoch_order) for row in ranks[0] for ref in row)
    assert not found - wanted
    assert sum((wanted - found).values()) == epoch_order.summary.dropped_clips
    assert epoch_order.summary.rows - epoch_order.steps * order.global_batch < order.global_batch


@given(layouts(), orders())
def test_the_report_counts_what_is_delivered(sources: list[SourceLayout], order: OrderConfig) -> None:
    order = replace(order, global_batch=1) if order.remainder is Remainder.DROP else order
    epoch_order = order_epoch(sources, order, 0)
    steps = [ranks[0] for ranks in rows_of(epoch_order)]
    lengths = [[int(epoch_order.sequence_latents[row].sum()) for row in step] for step in steps]
    space = sum((order.row_latents or max(step)) * len(step) for step in lengths)
    summary = epoch_order.summary
    assert (summary.clips, summary.steps) == (len(epoch_order.refs), len(steps))
    assert summary.padded_rows == sum(not row for step in steps for row in step)
    assert summary.rows + summary.repeated_rows + summary.padded_rows == len(steps) * order.global_batch
    assert summary.padding_share == pytest.approx(1 - sum(map(sum, lengths)) / space)  # the same sums, once rounded


@given(layouts(), orders())
def test_a_plan_is_a_function_of_its_arguments(sources: list[SourceLayout], order: OrderConfig) -> None:
    order = replace(order, global_batch=1)
    np.random.seed(1)  # noqa: NPY002 - that it changes nothing is the point
    first = rows_of(order_epoch(sources, order, 2))
    np.random.seed(2)  # noqa: NPY002
    assert rows_of(order_epoch(sources, order, 2)) == first


def test_rows_of_joined_clips_hold_no_more_than_their_length() -> None:
    order = OrderConfig(global_batch=4, arrangement=Arrangement.JOIN, row_latents=LONGEST, pool=8, max_latents=7)
    latents = np.arange(200, dtype=np.int32) % LONGEST + 1
    sources = [SourceLayout(shard_clips=np.array([200]), latents=latents)]
    epoch_order = order_epoch(sources, order, 0)
    lengths = [epoch_order.sequence_latents[row].sum() for ranks in rows_of(epoch_order) for row in ranks[0]]
    assert max(lengths) <= LONGEST
    assert epoch_order.sequence_latents.max() == 7
    plain = replace(order, arrangement=Arrangement.PLAIN, row_latents=0)
    assert epoch_order.summary.padding_share < order_epoch(sources, plain, 0).summary.padding_share / 2


def test_buckets_pad_less_than_plain_rows() -> None:
    latents = np.random.default_rng(0).integers(5, 40, 2000).astype(np.int32)
    sources = [SourceLayout(shard_clips=np.full(20, 100), latents=latents)]
    shares = [
        order_epoch(sources, OrderConfig(arrangement=arrangement, pool=pool), 0).summary.padding_share
        for arrangement, pool in [(Arrangement.PLAIN, 1), (Arrangement.BUCKET, 8), (Arrangement.BUCKET, 32)]
    ]
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < shares[0] / 2


def test_weights_bring_each_clip_equally_often() -> None:
    sources = [*one_source(30, weight=0.5), *one_source(10, weight=1.5)]
    order = OrderConfig(global_batch=7, remainder=Remainder.PAD)
    counts: Counter[int] = Counter()
    for epoch in range(4):
        counts.update(ref for ranks in rows_of(order_epoch(sources, order, epoch)) for row in ranks[0] for ref in row)
    assert counts == Counter({ref: 2 if ref < 30 else 6 for ref in range(40)})


@pytest.mark.parametrize("world_size", [0, 5, 16])
def test_a_world_size_that_does_not_divide_the_batch_is_a_wrong_request(world_size: int) -> None:
    with pytest.raises(ConfigError, match=f"must divide global_batch = 8, found {world_size}"):
        rows_per_rank(OrderConfig(global_batch=8), world_size)


@pytest.mark.parametrize(("step", "rank"), [(-1, 0), (6, 0), (0, -1), (0, 2)])
def test_steps_and_ranks_that_are_not_there_are_refused(step: int, rank: int) -> None:
    epoch_order = order_epoch(one_source(), OrderConfig(), 0)
    with pytest.raises(ValueError, match="must exist"):
        epoch_order.rows(step, rank, 2)


def test_an_epoch_without_a_step_is_a_wrong_request() -> None:
    with pytest.raises(ConfigError, match="its 5 rows do not fill a global batch of 8; lower global_batch"):
        order_epoch(one_source(5), OrderConfig(), 0)
    with pytest.raises(ConfigError, match="its 0 rows do not fill"):
        order_epoch(one_source(1, weight=0.1), OrderConfig(remainder=Remainder.PAD), 0)
    assert order_epoch(one_source(5), OrderConfig(remainder=Remainder.PAD), 0).steps == 1


def test_a_clip_longer_than_a_row_is_a_wrong_request_that_says_what_to_set() -> None:
    order = OrderConfig(arrangement=Arrangement.JOIN, row_latents=6)
    with pytest.raises(ConfigError, match="set row_latents to at least 9, or max_latents to at most 6"):
        order_epoch(one_source(latents=9), order, 0)
    assert order_epoch(one_source(latents=9), replace(order, max_latents=6), 0).steps == 6


def test_chunk_sizes_are_drawn_for_each_sequence_of_an_epoch() -> None:
    order, refs = OrderConfig(seed=2, chunk_sizes=(1, 2, 4)), np.arange(3000)
    drawn = chunk_sizes(refs, order, 0)
    counts = np.bincount(drawn, minlength=5)[[1, 2, 4]]
    assert counts.sum() == 3000
    assert abs(counts - 1000).max() < 5 * (3000 * 1 / 3 * 2 / 3) ** 0.5  # five standard deviations of a third of 3000
    np.testing.assert_array_equal(chunk_sizes(refs[[7, 5]], order, 0), drawn[[7, 5]])
    assert (chunk_sizes(refs, order, 1) != drawn).any()
    assert (chunk_sizes(refs, replace(order, seed=3), 0) != drawn).any()
    assert chunk_sizes(refs[:12], order, 0).tolist() == [2, 2, 2, 2, 1, 2, 2, 4, 4, 2, 1, 1]


def test_the_plan_of_a_seed_stays_what_it_was() -> None:
    """Runs that were saved go on in it: it must not change, with whatever version of numpy."""
    order = OrderConfig(seed=5, global_batch=3, block_clips=2, window_blocks=2, arrangement=Arrangement.BUCKET, pool=2)
    sources = [
        SourceLayout(shard_clips=np.array([4, 3]), latents=np.array([3, 1, 2, 3, 1, 2, 3], np.int32)),
        SourceLayout(shard_clips=np.array([2]), latents=np.array([2, 1], np.int32), weight=1.5),
    ]
    found = [[row.tolist() for row in order_epoch(sources, order, 1).rows(step, 0, 1)] for step in range(3)]
    assert found == [[[1], [4], [6]], [[8], [5], [3]], [[0], [8], [7]]]
