import pickle
from collections import Counter
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import OrderConfig, SourceConfig
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.sources.queries import QueryConfig, draw_replan_latents, open_queries, replan_choices

LATENTS = {0: 5, 1: 6, 2: 7, 3: 9, 4: 14}
PADDED = {0: 0, 1: 0, 2: 3, 3: 16, 4: 17}
"""Clips by number: of F latents with so many still frames at the end."""

LAST_REAL = {0: 4, 1: 5, 2: 5, 3: 4, 4: 8}
"""Their last latent with four real raw frames: (4 (F - 1) - still) // 4, by hand."""


@pytest.fixture
def long_release(tmp_path, make_clip, tiny):
    """Five clips of the training split, of different lengths and paddings."""
    clips = [
        make_clip(f"synth_d435i/home_0001/{number:06d}", latents=LATENTS[number], padded_frames=PADDED[number])
        for number in LATENTS
    ]
    tiny.pack(tmp_path / "long", clips, shard_bytes=400_000)
    return str(tmp_path / "long")


def number_of(key):
    return int(key[-1])


def admissible(number, future, longest=128):
    """Latents that leave `future` real ones, the slow way: each is tried."""
    return [r for r in range(1, LAST_REAL[number] + 1) if r + future <= LAST_REAL[number] and r < longest]


@pytest.mark.parametrize(("future", "longest"), [(4, 128), (1, 128), (2, 3), (1, 2), (3, 4)])
def test_a_latent_is_replanned_from_when_real_future_follows_and_the_history_is_short_enough(
    long_release, future, longest
):
    [table] = open_sources([SourceConfig(release=long_release)]).tables
    choices = replan_choices(table, QueryConfig(future_latents=future, max_history_latents=longest))
    expected = {number: len(admissible(number, future, longest)) for number in LATENTS}
    assert dict(zip(map(number_of, table.keys(range(len(table)))), choices.tolist(), strict=True)) == expected


@pytest.mark.parametrize("per_clip", [1, 2, 3, 50])
def test_a_clip_has_as_many_queries_as_asked_for_or_as_it_can_have(long_release, per_clip):
    queries = QueryConfig(queries_per_clip=per_clip, future_latents=2)
    sources = open_queries([SourceConfig(release=long_release)], queries)
    counts = Counter(number_of(key) for key in sources.keys(np.arange(sources.clips)))
    assert counts == {number: min(per_clip, len(admissible(number, 2))) for number in LATENTS}
    for epoch in range(3):
        replan = sources.replan_latents(OrderConfig(seed=1), epoch)
        by_clip = {number: [] for number in LATENTS}
        for key, latent in zip(sources.keys(np.arange(sources.clips)), replan.tolist(), strict=True):
            by_clip[number_of(key)].append(latent)
        for number, latents in by_clip.items():
            assert len(set(latents)) == len(latents)
            assert set(latents) <= set(admissible(number, 2))


def test_clips_that_are_too_short_are_counted_and_said(long_release, caplog):
    sources = open_queries([SourceConfig(release=long_release)], QueryConfig())
    assert "2 of 5 clips are too short for a query" in caplog.text  # 0 and 3: no four real latents after latent 1
    assert {number_of(key) for key in sources.keys(np.arange(sources.clips))} == {1, 2, 4}


def test_a_source_without_a_query_is_refused(long_release):
    with pytest.raises(ConfigError, match=r"none of 5 clips has them; lower future_latents"):
        open_queries([SourceConfig(release=long_release)], QueryConfig(future_latents=8))


def test_sequences_of_the_plan_end_with_the_replan_latent(long_release):
    sources = open_queries([SourceConfig(release=long_release)], QueryConfig(queries_per_clip=2, future_latents=1))
    order = OrderConfig(global_batch=3)
    for epoch in range(3):
        epoch_order = sources.order_epoch(order, epoch)
        assert epoch_order.sequence_latents.tolist() == (sources.replan_latents(order, epoch) + 1).tolist()
        refs = [
            ref for step in range(epoch_order.steps) for row in epoch_order.rows(step, 0, 1) for ref in row.tolist()
        ]
        assert len(set(refs)) == len(refs) == 3 * (sources.clips // 3)


def test_two_sources_of_queries_are_numbered_one_after_the_other(long_release):
    configs = [SourceConfig(release=long_release, weight=weight) for weight in (1.0, 2.0)]
    sources = open_queries(configs, QueryConfig(queries_per_clip=2))
    one, two = sources.tables
    assert (one.base, two.base) == (0, len(one))
    order = OrderConfig(seed=2, global_batch=1)
    replan = sources.replan_latents(order, 0)
    assert len(replan) == sources.clips == 2 * len(one)
    assert replan[: len(one)].tolist() != replan[len(one) :].tolist()
    assert sources.order_epoch(order, 0).steps == 3 * len(one)


def test_a_table_of_queries_as_long_as_the_index_reads_its_own_rows(long_release):
    """Three of five clips have queries: one, one, and three of the four it could have."""
    [table] = open_queries([SourceConfig(release=long_release)], QueryConfig(queries_per_clip=3)).tables
    assert len(table) == len(table.release.index) == 5
    numbers = [number_of(key) for key in table.keys(range(5))]
    assert table.column("latents").tolist() == [LATENTS[number] for number in numbers]


def test_a_cut_of_sequences_is_refused(long_release):
    sources = open_queries([SourceConfig(release=long_release)], QueryConfig())
    with pytest.raises(ConfigError, match="max_latents must be 0, found 3; set max_history_latents"):
        sources.order_epoch(OrderConfig(max_latents=3), 0)


def test_the_settings_of_queries_are_part_of_what_the_order_is_drawn_over(long_release):
    settings_of = [QueryConfig(), QueryConfig(queries_per_clip=2), QueryConfig(future_latents=3)]
    identities = [open_queries([SourceConfig(release=long_release)], one).identity() for one in settings_of]
    assert [identity[0]["queries"] for identity in identities] == [asdict(one) for one in settings_of]


def test_queries_cross_to_another_process_as_settings(long_release):
    sources = open_queries([SourceConfig(release=long_release)], QueryConfig(queries_per_clip=2))
    there = pickle.loads(pickle.dumps(sources))  # noqa: S301  # what was just written
    assert there.identity() == sources.identity()
    assert there.replan_latents(OrderConfig(), 3).tolist() == sources.replan_latents(OrderConfig(), 3).tolist()


@pytest.mark.parametrize(
    "changes", [{"queries_per_clip": 0}, {"future_latents": 0}, {"max_history_latents": 1}], ids=str
)
def test_settings_that_leave_no_query_are_refused(changes):
    with pytest.raises(ValueError, match="must be at least"):
        QueryConfig(**changes)


@settings(max_examples=50)
@given(
    counts=st.lists(st.tuples(st.integers(1, 5), st.integers(0, 20)), max_size=12),
    seed=st.integers(0, 2**40),
    epoch=st.integers(0, 100),
)
def test_draws_of_a_clip_are_distinct_and_lie_in_its_range(counts, seed, epoch):
    rows = np.repeat(np.arange(len(counts)), [count for count, _ in counts]).astype(np.int64)
    choices = np.repeat([count + more for count, more in counts], [count for count, _ in counts]).astype(np.int64)
    drawn = draw_replan_latents(rows, choices, seed, epoch, 0)
    for number, (count, more) in enumerate(counts):
        own = drawn[rows == number].tolist()
        assert len(set(own)) == count
        assert set(own) <= set(range(1, count + more + 1))


def test_every_pair_of_latents_is_drawn_equally_often():
    """20 ordered pairs of 5 latents over 40,000 clips: 2,000 each; five standard deviations are 218."""
    clips = 40_000
    rows = np.repeat(np.arange(clips), 2)
    drawn = draw_replan_latents(rows, np.full(2 * clips, 5), 7, 0, 0).reshape(clips, 2)
    times = Counter(map(tuple, drawn.tolist()))
    assert len(times) == 20
    assert max(abs(count - clips / 20) for count in times.values()) < 5 * np.sqrt(clips * (1 / 20) * (19 / 20))


def test_each_epoch_draws_anew():
    rows, choices = np.arange(1000), np.full(1000, 10)
    first, again, other = (draw_replan_latents(rows, choices, 0, epoch, 0) for epoch in (0, 0, 1))
    assert first.tolist() == again.tolist()
    assert 0.05 < (first == other).mean() < 0.15  # one in ten agrees by chance, give or take three deviations
