from collections import Counter
from dataclasses import asdict
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder
from wsm_data.loaders.ledger.audit import audit_epochs, sightings
from wsm_data.loaders.ledger.timeline import read_timeline
from wsm_data.loaders.ledger.writer import LedgerWriter
from wsm_data.loaders.order.epoch_order import order_epoch
from wsm_data.loaders.order.pass_order import SourceLayout


def layout_of(clips, weight=1.0):
    """A source of shards of seven clips."""
    shard_clips = np.array([7] * (clips // 7) + [clips % 7] * bool(clips % 7))
    return SourceLayout(shard_clips=shard_clips, latents=np.full(clips, 5, np.int32), weight=weight)


def record(folder, layouts, order, *, world_size=2, epochs=1, last_step=None, change=lambda step, rank, refs: refs):
    """A run of whole epochs, or up to `last_step` of the last one; `change` falsifies what is recorded."""
    sources = [{"clips": len(layout), "weight": layout.weight} for layout in layouts]
    identity = {"sources": sources, "order": asdict(order)}
    for rank in range(world_size):
        with LedgerWriter(folder, identity, rank, world_size) as writer:
            for epoch in range(epochs):
                epoch_order = order_epoch(layouts, order, epoch)
                writer.begin(epoch, 0, epoch_order.steps)
                for step in range(epoch_order.steps if last_step is None or epoch < epochs - 1 else last_step):
                    refs = np.concatenate(epoch_order.rows(step, rank, world_size))
                    writer.record(epoch, step, change(step, rank, refs))
    return read_timeline(folder)


def sources_of(layouts):
    """What the audit asks of sources: their orders, and how many clips they have."""
    return SimpleNamespace(order_epoch=partial(order_epoch, layouts), clips=sum(map(len, layouts)))


def misfits(audits):
    return [misfit for audit in audits for misfit in audit.misfits]


REMAINDERS = list(Remainder)


@settings(max_examples=40)
@given(
    clips=st.lists(st.integers(1, 30), min_size=1, max_size=3),
    weights=st.lists(st.sampled_from([1.0, 2.0, 0.5, 0.7, 1.5]), min_size=3, max_size=3),
    batch=st.sampled_from([2, 4, 6]),
    remainder=st.sampled_from(REMAINDERS),
    arrangement=st.sampled_from(list(Arrangement)),
    seed=st.integers(0, 5),
)
def test_a_run_that_followed_its_order_fits(tmp_path_factory, clips, weights, batch, remainder, arrangement, seed):
    order = OrderConfig(
        seed=seed,
        global_batch=batch,
        remainder=remainder,
        arrangement=arrangement,
        row_latents=12 if arrangement is Arrangement.JOIN else 0,
    )
    layouts = [layout_of(*pair) for pair in zip(clips, weights, strict=False)]
    if (
        arrangement is Arrangement.JOIN
        or sum(weight * count for count, weight in zip(clips, weights, strict=False)) < 12
    ):
        layouts.append(layout_of(60))
    timeline = record(tmp_path_factory.mktemp("ledger"), layouts, order, epochs=2)
    audits = audit_epochs(timeline, sources_of(layouts))
    assert misfits(audits) == []
    for audit in audits:
        epoch_order = order_epoch(layouts, order, audit.epoch)
        refs = [
            ref for step in range(epoch_order.steps) for row in epoch_order.rows(step, 0, 1) for ref in row.tolist()
        ]
        times = Counter(refs)
        assert audit.complete
        assert audit.delivered == len(refs)
        assert audit.seen_once == sum(count == 1 for count in times.values())
        assert audit.seen_more == sum(count > 1 for count in times.values())
        assert audit.seen_once + audit.seen_more + audit.never == sum(len(layout) for layout in layouts)
        assert audit.summary == epoch_order.summary


def test_an_epoch_that_was_stopped_is_not_complete_and_fits_as_far_as_it_went(tmp_path):
    timeline = record(tmp_path, [layout_of(20)], OrderConfig(global_batch=4), epochs=2, last_step=3)
    whole, stopped = audit_epochs(timeline, sources_of([layout_of(20)]))
    assert (whole.complete, stopped.complete) == (True, False)
    assert (stopped.recorded, stopped.steps, stopped.seen_once) == (3, 5, 12)
    assert misfits([whole, stopped]) == []


def swap_ranks(step, rank, refs):
    return refs[::-1] if step == 2 else refs


def other_clip(step, rank, refs):
    return np.where(refs == refs.max(), refs.max() - 1, refs) if step == 1 and rank == 1 else refs


def unknown_clip(step, rank, refs):
    return refs + 1000 if step == 0 else refs


def one_less(step, rank, refs):
    return refs[:1] if step == 3 else refs


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (swap_ranks, "step 2 must bring rank 0 of 2 the refs"),
        (other_clip, "step 1 must bring rank 1 of 2 the refs"),
        (unknown_clip, "4 refs are none of the 20 clips"),
        (one_less, "step 3 must bring rank 0 of 2 the refs"),
    ],
)
def test_what_does_not_fit_is_said(tmp_path, change, message):
    layouts = [layout_of(20)]
    timeline = record(tmp_path, layouts, OrderConfig(global_batch=4), change=change)
    assert any(message in misfit for misfit in misfits(audit_epochs(timeline, sources_of(layouts))))


def test_an_order_of_another_length_does_not_fit(tmp_path):
    timeline = record(tmp_path, [layout_of(20)], OrderConfig(global_batch=4))
    [audit] = audit_epochs(timeline, sources_of([layout_of(12)]))
    assert "epoch 0: the order has 3 steps, but the ledger says 5" in audit.misfits


def test_many_misfits_are_counted(tmp_path):
    layouts = [layout_of(60)]
    timeline = record(tmp_path, layouts, OrderConfig(global_batch=4), change=lambda step, rank, refs: refs[::-1])
    [audit] = audit_epochs(timeline, sources_of(layouts))
    assert len(audit.misfits) == 6
    assert audit.misfits[-1] == "epoch 0: 25 more steps do not fit the order"


def test_every_delivery_of_a_clip_is_found_and_those_that_were_lost_are_marked(tmp_path):
    layouts, order = [layout_of(20)], OrderConfig(global_batch=4)
    record(tmp_path, layouts, order, epochs=1, last_step=4)
    timeline = record(tmp_path, layouts, order, epochs=2, world_size=1)
    orders = [order_epoch(layouts, order, epoch) for epoch in range(2)]
    for ref in range(20):
        expected = []
        for epoch, steps, world_size, counts in [(0, 4, 2, False), (0, 5, 1, True), (1, 5, 1, True)]:
            for step in range(steps):
                for rank in range(world_size):
                    if ref in np.concatenate(orders[epoch].rows(step, rank, world_size)):
                        expected.append((epoch, step, rank, world_size, counts))
        found = [
            (seen.epoch, seen.step, seen.rank, seen.world_size, seen.counts) for seen in sightings(timeline, [ref])
        ]
        assert sorted(found) == sorted(expected)
