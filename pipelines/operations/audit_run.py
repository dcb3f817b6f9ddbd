"""`wsm audit-run`: the proof that a run saw each clip as often as its order says, and when it saw which."""

from collections.abc import Sequence
from pathlib import Path

import typer

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.ledger.audit import EpochAudit, audit_epochs, sightings
from wsm_data.loaders.ledger.sources import open_recorded_sources, recorded_order, refs_of_key
from wsm_data.loaders.ledger.timeline import Timeline, read_timeline, steps_text
from wsm_data.loaders.sources.clips import Sources
from wsm_data.view.drawing.text_table import aligned


def audit_run(
    folder: Path,
    releases: Sequence[str],
    selections: Sequence[str],
    clip: str | None,
    epoch: int | None,
    step: int | None,
) -> None:
    """Print what a ledger proves, or when a clip was seen, or what a step brought.

    Args:
        folder: the ledger.
        releases: paths or URLs of the releases of the run, in any order.
        selections: selection files of the run that do not stand in their release.
        clip: key of a clip.
        epoch: epoch of a step.
        step: the step.

    Raises:
        ConfigError: the question or the releases are wrong.
        IntegrityError: something in the ledger does not fit.
    """
    if (epoch is None) != (step is None) or (clip is not None and step is not None):
        raise ConfigError("ask for one clip by --clip, or for one step by --epoch and --step together")
    timeline = read_timeline(folder)
    sources = open_recorded_sources(timeline.identity, releases, selections)
    if clip is not None:
        _print_clip(timeline, sources, clip)
    elif epoch is not None and step is not None:
        _print_step(timeline, sources, epoch, step)
    else:
        _print_audit(timeline, sources, folder)


def _print_clip(timeline: Timeline, sources: Sources, key: str) -> None:
    rows = [("epoch", "step", "rank", "of", "session", "")]
    found = sightings(timeline, refs_of_key(sources, key))
    for seen in sorted(found, key=lambda one: (one.epoch, one.step, one.counts, one.rank)):
        place = (f"{seen.epoch:,}", f"{seen.step:,}", str(seen.rank), str(seen.world_size), seen.session)
        rows.append((*place, "" if seen.counts else "lost with its run, trained again"))
    typer.echo(aligned(rows, right=range(4)) if len(rows) > 1 else f"{key} was not delivered at any recorded step")


def _print_step(timeline: Timeline, sources: Sources, epoch: int, step: int) -> None:
    records = {record.epoch: record for record in timeline.epochs}
    stretches = records[epoch].stretches if epoch in records else ()
    found = [stretch for stretch in stretches if stretch.start <= step < stretch.end]
    if not found:
        spans = (f"{one.epoch} (steps 0 to {one.steps})" for one in records.values())
        raise ConfigError(
            f"step {step} of epoch {epoch} was not recorded by all ranks; there are epochs {', '.join(spans)}"
        )
    rows = [("rank", "ref", "clip")]
    for rank, refs in enumerate(found[0].refs(step)):
        rows += [(str(rank), str(ref), key) for ref, key in zip(refs.tolist(), sources.keys(refs), strict=True)]
    typer.echo(aligned(rows, right=(0, 1)))


def _print_audit(timeline: Timeline, sources: Sources, folder: Path) -> None:
    audits = audit_epochs(timeline, sources)
    typer.echo(_head(timeline) + "\n\n" + _epoch_table(audits) + "\n")
    for again in timeline.again:
        typer.echo(
            f"epoch {again.epoch}: {steps_text(again.start, again.end)} of session {again.session} lost with it, and "
            "trained again"
        )
    if timeline.ahead:
        typer.echo(f"the last session: rank 0 recorded {timeline.ahead} steps at its end that another rank has not")
    beginning = _beginning(timeline)
    if beginning:
        typer.echo(f"the ledger begins with {beginning}: it says nothing of what came before")
    misfits = [*timeline.misfits, *(misfit for audit in audits for misfit in audit.misfits)]
    if not any(audit.recorded for audit in audits):
        misfits.append("at least one step must have been recorded by all ranks, found none")
    if misfits:
        raise IntegrityError(f"{folder} does not prove an uninterrupted course:\n  " + "\n  ".join(misfits))
    typer.echo(_verdict(audits, beginning))


def _beginning(timeline: Timeline) -> str:
    """Where a ledger begins that was switched on in mid-run; empty where it begins with the run, or has no start."""
    first = timeline.epochs[0] if timeline.epochs else None
    return f"step {first.start} of epoch {first.epoch}" if first and (first.epoch or first.start) else ""


def _head(timeline: Timeline) -> str:
    order = recorded_order(timeline.identity)
    worlds = sorted({file.world_size for file in timeline.files})
    killed = sum(not file.closed for file in timeline.files)
    torn_bytes = sum(file.torn_bytes for file in timeline.files)
    torn = f", {torn_bytes:,} bytes of records that were cut short" if torn_bytes else ""
    rows = [("ledger of", "release", "split", "selection", "clips", "weight")]
    for source in timeline.identity["sources"]:
        names = (source["release"], source["release_digest"][:16], source["split"] or "all", source["selection"] or "-")
        rows.append((*names, f"{source['clips']:,}", f"{source['weight']:g}"))
    return (
        aligned(rows, right=(4, 5))
        + f"\nseed {order.seed}, global batch {order.global_batch}, remainder {order.remainder}, {order.arrangement}; "
        f"world size {', '.join(map(str, worlds))}; {len(timeline.files)} files, {killed} of them not closed{torn}"
    )


def _epoch_table(audits: Sequence[EpochAudit]) -> str:
    rows = [("epoch", "steps", "of", "clips seen", "once", "more often", "never", "explained by the order")]
    for audit in audits:
        steps = (f"{audit.epoch:,}", f"{audit.recorded:,}", f"{audit.steps:,}", f"{audit.delivered:,}")
        times = (f"{audit.seen_once:,}", f"{audit.seen_more:,}", f"{audit.never:,}")
        rows.append((*steps, *times, _explained(audit)))
    return aligned(rows, right=range(7))


def _explained(audit: EpochAudit) -> str:
    if audit.misfits:
        return "does not fit"
    if not audit.complete:
        return "not complete"
    parts = (
        ("dropped clips", audit.summary.dropped_clips),
        ("repeated rows", audit.summary.repeated_rows),
        ("empty rows", audit.summary.padded_rows),
    )
    return ", ".join(f"{words}: {count:,}" for words, count in parts if count) or "every clip"


def _verdict(audits: Sequence[EpochAudit], beginning: str) -> str:
    complete = [audit.epoch for audit in audits if audit.complete]
    since = f" from {beginning} on" if beginning else ""
    return (
        f"{len(complete)} of {len(audits)} epochs complete, no step missing{since}, none twice: every recorded step "
        "brought what the order says"
    )
