"""The proof that a run saw each clip as often as its order says, from the ledger its ranks wrote.

The order is computed anew from the releases of the run, and every recorded step is compared with it, rank by rank.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from wsm_data.loaders.ledger.sources import recorded_order
from wsm_data.loaders.ledger.timeline import EpochRecord, Timeline
from wsm_data.loaders.order.epoch_order import EpochOrder, EpochSummary
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
        summary: what the order says becomes of the clips.
        misfits: what does not fit, in sentences.
    """

    epoch: int
    steps: int
    recorded: int
    delivered: int
    seen_once: int
    seen_more: int
    never: int
    summary: EpochSummary
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


def audit_epochs(timeline: Timeline, sources: Sources) -> tuple[EpochAudit, ...]:
    """Audit every epoch of a ledger.

    Args:
        timeline: the ledger.
        sources: the sources of the run (`open_recorded_sources`).
    """
    order = recorded_order(timeline.identity)
    return tuple(
        _audit_epoch(record, sources.order_epoch(order, record.epoch), sources.clips) for record in timeline.epochs
    )


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


def _audit_epoch(record: EpochRecord, epoch_order: EpochOrder, clips: int) -> EpochAudit:
    given = [np.concatenate(refs) for _, refs in record.by_step()]
    refs = np.concatenate([np.empty(0, np.int64), *given])
    unknown = (refs < 0) | (refs >= clips)
    times = np.bincount(refs[~unknown], minlength=clips)
    misfits = [f"{int(unknown.sum())} refs are none of the {clips} clips of the sources"] if unknown.any() else []
    misfits += _against_order(record, epoch_order)
    return EpochAudit(
        epoch=record.epoch,
        steps=record.steps,
        recorded=record.recorded,
        delivered=len(refs),
        seen_once=int((times == 1).sum()),
        seen_more=int((times > 1).sum()),
        never=int((times == 0).sum()),
        summary=epoch_order.summary,
        misfits=tuple(f"epoch {record.epoch}: {misfit}" for misfit in misfits),
    )


def _against_order(record: EpochRecord, epoch_order: EpochOrder) -> list[str]:
    """Every recorded step must have brought what the order says, rank by rank in this order."""
    misfits = []
    if epoch_order.steps != record.steps:
        misfits.append(f"the order has {epoch_order.steps} steps, but the ledger says {record.steps}")
    for step, refs in record.by_step():
        if step < epoch_order.steps:
            for rank, given in enumerate(refs):
                wanted = np.concatenate(epoch_order.rows(step, rank, len(refs)))
                if not np.array_equal(given, wanted):
                    misfits.append(
                        f"step {step} must bring rank {rank} of {len(refs)} the refs {wanted.tolist()}, "
                        f"found {given.tolist()}"
                    )
    return _first(misfits)


def _first(misfits: list[str]) -> list[str]:
    more = len(misfits) - _SHOWN
    return misfits if more <= 0 else [*misfits[:_SHOWN], f"{more} more steps do not fit the order"]
