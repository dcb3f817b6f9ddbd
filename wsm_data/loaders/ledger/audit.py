"""The proof that a run saw each clip as often as its plan says, from the ledger its ranks wrote.

With the releases at hand every recorded step is compared with the plan, computed anew: the strongest proof. Without
them the counts of an epoch are held against what any order of such sources must have.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder
from wsm_data.loaders.ledger.sources import recorded_order
from wsm_data.loaders.ledger.timeline import EpochRecord, Timeline
from wsm_data.loaders.order.epoch_plan import EpochPlan, PlanReport
from wsm_data.loaders.order.mixing import stretch_of_epoch
from wsm_data.loaders.order.stable_hash import Int64Array
from wsm_data.loaders.sources.clips import Sources

_SHOWN = 5
"""Misfits of one kind that are spelled out."""


@dataclass(frozen=True, kw_only=True)
class EpochAudit:
    """What became of the clips in one epoch.

    Attributes:
        epoch: the epoch.
        steps: steps the whole epoch has.
        recorded: steps that were recorded by all ranks.
        delivered: clips of those steps, one that came twice counted twice.
        seen_once: clips that were seen once.
        seen_more: clips that were seen more often.
        never: clips of the sources that were not seen.
        plan: what the plan says becomes of the clips; None where it was not computed.
        misfits: what does not fit, in sentences.
    """

    epoch: int
    steps: int
    recorded: int
    delivered: int
    seen_once: int
    seen_more: int
    never: int
    plan: PlanReport | None
    misfits: tuple[str, ...] = field(default=())

    @property
    def complete(self) -> bool:
        """Whether every step of the epoch was recorded."""
        return self.recorded == self.steps


@dataclass(frozen=True, kw_only=True)
class Sighting:
    """A step at which a rank was given a clip.

    Attributes:
        epoch: the epoch.
        step: the step.
        rank: the rank that was given the clip.
        world_size: number of ranks.
        session: session of that rank's process.
        counts: False where the step was lost with a run that was killed, and was trained again.
    """

    epoch: int
    step: int
    rank: int
    world_size: int
    session: str
    counts: bool


def audit_epochs(timeline: Timeline, sources: Sources | None) -> tuple[EpochAudit, ...]:
    """Audit every epoch of a ledger.

    Args:
        timeline: the ledger.
        sources: the sources of the run (`open_recorded_sources`), for the comparison with the plan; None for the
            counts alone.
    """
    order = recorded_order(timeline.identity)
    return tuple(_audit_epoch(record, timeline.identity["sources"], order, sources) for record in timeline.epochs)


def sightings(timeline: Timeline, refs: Sequence[int]) -> Iterator[Sighting]:
    """Every recorded step at which one of these clips was delivered, those that were lost included."""
    live = {
        id(segment): stretch.end
        for record in timeline.epochs
        for stretch in record.stretches
        for segment in stretch.segments
    }
    wanted = np.asarray(refs, np.int64)
    for file in timeline.files:
        for segment in file.segments:
            for step, given in enumerate(segment.refs, start=segment.start):
                if np.isin(given, wanted).any():
                    yield Sighting(
                        epoch=segment.epoch,
                        step=step,
                        rank=file.rank,
                        world_size=file.world_size,
                        session=file.session,
                        counts=step < live.get(id(segment), -1),
                    )


def _audit_epoch(
    record: EpochRecord, stated: Sequence[dict[str, Any]], order: OrderConfig, sources: Sources | None
) -> EpochAudit:
    plan = sources.plan(order, record.epoch) if sources is not None else None
    clips = sum(source["clips"] for source in stated)
    given = [np.concatenate(refs) for _, refs in record.by_step()]
    refs = np.concatenate([np.empty(0, np.int64), *given])
    unknown = (refs < 0) | (refs >= clips)
    times = np.bincount(refs[~unknown], minlength=clips)
    misfits = [f"{int(unknown.sum())} refs are none of the {clips} clips of the sources"] if unknown.any() else []
    misfits += _against_plan(record, plan) if plan is not None else _against_counts(record, stated, order, times)
    return EpochAudit(
        epoch=record.epoch,
        steps=record.steps,
        recorded=record.recorded,
        delivered=len(refs),
        seen_once=int((times == 1).sum()),
        seen_more=int((times > 1).sum()),
        never=int((times == 0).sum()),
        plan=plan.report if plan is not None else None,
        misfits=tuple(f"epoch {record.epoch}: {misfit}" for misfit in misfits),
    )


def _stretch(source: dict[str, Any], epoch: int) -> tuple[int, int]:
    return stretch_of_epoch(source["clips"], source["weight"], epoch)


def _against_plan(record: EpochRecord, plan: EpochPlan) -> list[str]:
    """Every recorded step must have brought what the plan says, rank by rank in this order."""
    misfits = []
    if plan.steps != record.steps:
        misfits.append(f"the plan has {plan.steps} steps, but the ledger says {record.steps}")
    for step, refs in record.by_step():
        if step < plan.steps:
            for rank, given in enumerate(refs):
                planned = np.concatenate(plan.rows(step, rank, len(refs)))
                if not np.array_equal(given, planned):
                    misfits.append(
                        f"step {step} must bring rank {rank} of {len(refs)} the refs {planned.tolist()}, "
                        f"found {given.tolist()}"
                    )
    return _first(misfits)


def _against_counts(
    record: EpochRecord, stated: Sequence[dict[str, Any]], order: OrderConfig, times: Int64Array
) -> list[str]:
    """What any order of such sources must have: no clip too often, and none missing but for the remainder."""
    most, base = np.empty(len(times), np.int64), 0
    least = np.empty(len(times), np.int64)
    for source in stated:
        clips = source["clips"]
        first, last = _stretch(source, record.epoch)
        own = slice(base, base + clips)
        most[own] = -(-last // clips) - first // clips  # each pass that the epoch touches brings a clip once
        least[own] = max(last // clips + first // -clips, 0)  # each pass that lies in the epoch as a whole
        base += clips
    too_often, missing = int(np.maximum(times - most, 0).sum()), int(np.maximum(least - times, 0).sum())
    misfits = []
    if too_often and order.remainder is not Remainder.REPEAT:
        misfits.append(f"{too_often} deliveries are of clips that had been seen as often as their sources give them")
    if record.recorded == record.steps and missing and order.remainder is not Remainder.DROP:
        misfits.append(f"{missing} deliveries are missing, though no clip may be left out with {order.remainder}")
    return misfits + (_against_slots(record, stated, order, int(times.sum())) if not misfits else [])


def _against_slots(
    record: EpochRecord, stated: Sequence[dict[str, Any]], order: OrderConfig, delivered: int
) -> list[str]:
    """With one clip a row, the number of steps and of deliveries is known; packed rows hold any number of clips."""
    if order.arrangement is Arrangement.PACK or record.recorded != record.steps:
        return []
    planned = sum(len(range(*_stretch(source, record.epoch))) for source in stated)
    full, rest = divmod(planned, order.global_batch)
    steps = full + (rest > 0 and order.remainder is not Remainder.DROP)
    wanted = planned if order.remainder is Remainder.PAD else steps * order.global_batch
    if (record.steps, delivered) == (steps, wanted):
        return []
    return [
        f"{planned} clips in steps of {order.global_batch} make {steps} steps with {wanted} deliveries "
        f"({order.remainder}), found {record.steps} with {delivered}"
    ]


def _first(misfits: list[str]) -> list[str]:
    more = len(misfits) - _SHOWN
    return misfits if more <= 0 else [*misfits[:_SHOWN], f"{more} more steps do not fit the plan"]
