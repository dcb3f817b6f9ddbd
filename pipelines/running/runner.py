"""Runs one stage: finds what is pending, has an engine do it, writes the ledger, keeps to the budget, finishes."""

import fnmatch
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Generic

from pipelines.running.budget import RefusalCount, count_refusals, over_budget, with_outcome
from pipelines.running.conflict import conflict, fingerprint
from pipelines.running.disk.full_disk import full_disk_named
from pipelines.running.disk.gone_folder import gone_folder_named
from pipelines.running.engines.choice import Engine
from pipelines.running.engines.local import run_local
from pipelines.running.folder import (
    StageRecord,
    digest_on_disk,
    is_as_written,
    locked,
    read_stage_record,
    write_stage_record,
)
from pipelines.running.given_up import reclaiming, require_given_back
from pipelines.running.ledger import LedgerEntry, compact_ledger, is_whole, ledger_appender, read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.progress import progress
from pipelines.running.quarantine import PENDING_FILE, QUARANTINE_FILE, write_pending, write_quarantine
from pipelines.running.settings import config_json, settings_of
from pipelines.running.stage import REFUSED, ConfigT, Finished, Outcome, Settled, Stage, StageContext, Unit, refused
from pipelines.running.stage_report import StageReport, beyond_outcomes, stage_report
from pipelines.running.upstream import pending_units, quarantine_of, upstream_records
from wsm_data.errors import BudgetExceeded, ConfigError, DataError, WsmError
from wsm_data.files.atomic import remove_temporaries
from wsm_data.files.digest import digest_json
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class _Job(Generic[ConfigT]):
    """One run of a stage: what is listed, and what the ledger said when it began."""

    stage: Stage[ConfigT]
    config: ConfigT
    out: Path
    record: StageRecord
    waits_for: tuple[str, ...]
    units: Sequence[Unit]
    keys: Mapping[str, str]
    finish_inputs: Mapping[str, str]
    ledger: dict[str, LedgerEntry]
    options: RunOptions
    engine: Engine

    def settled(self) -> Settled:
        """Outcomes under the present keys."""
        outcomes = {
            unit.id: self.ledger[unit.id].outcome
            for unit in self.units
            if unit.id in self.ledger and self.ledger[unit.id].key == self.keys[unit.id]
        }
        return Settled(outcomes=outcomes, pending=tuple(unit.id for unit in self.units if unit.id not in outcomes))


def run_stage(
    stage: Stage[ConfigT], config: ConfigT, out: Path, options: RunOptions | None = None, engine: Engine = run_local
) -> StageReport:
    """Bring a stage's folder up to date with its inputs.

    A unit is done again when its inputs, the settings or its outputs are not what the ledger says. Killed at any
    point, the next call goes on where this one was. Finished work is deleted only when its unit was done again, or is
    not listed although no stage before this one has pending units, from which it might come back.

    Raises:
        ConfigError: the folder belongs to other settings, or is being written by another process; or `options.only`
            matches nothing.
        BudgetExceeded: more was refused than `options.max_refused` allows.
        WsmError: the disk is full, a folder that is read or filled was deleted, or two units have one id.
    """
    options = options or RunOptions()
    started = time.monotonic()
    upstream = upstream_records(config)  # before the listing: what changes while that is read is seen as newer
    waits_for = tuple(name for name in upstream if pending_units(Path(getattr(config, name))))
    units = stage.list_units(config)
    if options.reclaim and stage.reads and waits_for:
        raise ConfigError(
            f"--reclaim gives up clips that `wsm {stage.name}` needs again when more follow, and there are pending "
            f"units in {', '.join(waits_for)}; run the stages before it to their end, or leave --reclaim out"
        )
    _require_unique(stage, units)
    _require_match(stage, units, options.only)
    record = _record(stage, config, upstream, len(units), options.processes)
    refused_here = conflict(stage, config, out)
    if refused_here and not options.fork:
        raise ConfigError(refused_here)
    out = out.with_name(f"{out.name}-{record.fingerprint[:8]}") if refused_here else out
    keys = {unit.id: unit_key(record, unit) for unit in units}
    job = _Job(
        stage=stage,
        config=config,
        out=out,
        record=record,
        waits_for=waits_for,
        units=units,
        keys=keys,
        finish_inputs=stage.finish_inputs(config) if stage.finish_inputs else {},
        ledger={},
        options=options,
        engine=engine,
    )
    if options.dry_run:
        job.ledger.update(_standing(out))
        return _report(job, _selected(job), 0.0)
    with full_disk_named(out), locked(out), gone_folder_named(config, out) as require_folders:
        remove_temporaries(out)
        job.ledger.update(_standing(out))
        selected = _selected(job)
        if selected and stage.reads:
            require_given_back(stage.reads(config, selected))
        if selected or not _is_finished(job):
            write_stage_record(out, record)  # unfinished from here to the end, for whoever reads it
            _work(job, selected)
            require_folders()
            _finish(job)
        else:
            _keep_record_current(job)
            with _reclaiming(job, ()):
                pass
    return _report(job, selected, time.monotonic() - started)


def _report(job: _Job[ConfigT], ran: Sequence[Unit], seconds: float) -> StageReport:
    settled = job.settled()
    extra = beyond_outcomes(settled, quarantine_of(job.out))
    report = stage_report(job.stage.name, job.out, settled, [unit.id for unit in ran], seconds, extra)
    return replace(report, waits_for=job.waits_for)


def unit_key(record: StageRecord, unit: Unit) -> str:
    """Key under which a unit is settled: digest of its inputs' content, the stage's version and its settings."""
    return digest_json({"fingerprint": record.fingerprint, "inputs": dict(unit.inputs)})


def _require_unique(stage: Stage[ConfigT], units: Sequence[Unit]) -> None:
    twice = [unit for unit, count in Counter(unit.id for unit in units).items() if count > 1]
    if twice:
        raise WsmError(f"{stage.name}: unit ids must be unique, found twice: {', '.join(sorted(twice)[:5])}")


def _require_match(stage: Stage[ConfigT], units: Sequence[Unit], only: Sequence[str]) -> None:
    unmatched = [one for one in only if not fnmatch.filter([unit.id for unit in units], one)]
    if unmatched:
        example = f"; ids look like {units[0].id}" if units else ""
        raise ConfigError(f"{stage.name}: --only {' '.join(unmatched)} matches none of {len(units)} units{example}")


def _record(
    stage: Stage[ConfigT], config: ConfigT, upstream: Mapping[str, StageRecord], units: int, workers: int
) -> StageRecord:
    return StageRecord(
        name=stage.name,
        version=stage.version,
        settings=settings_of(config),
        config=config_json(config),
        fingerprint=fingerprint(stage, config),
        inputs={name: record.fingerprint for name, record in upstream.items()},
        seen={name: record.finished for name, record in upstream.items()},
        units=units,
        workers=workers,
    )


def _standing(out: Path) -> dict[str, LedgerEntry]:
    """The last word on every unit whose outputs are as it left them; one whose outputs are not is pending again."""
    return {unit: entry for unit, entry in read_ledger(out, with_stale=True).items() if is_whole(out, entry)}


def _selected(job: _Job[ConfigT]) -> list[Unit]:
    """Pending units that the options ask for, in the order of the listing."""
    only = job.options.only
    chosen = [
        unit
        for unit in job.units
        if not _is_settled(job, unit) and (not only or any(fnmatch.fnmatch(unit.id, one) for one in only))
    ]
    return chosen[: job.options.limit] if job.options.limit else chosen


def _is_settled(job: _Job[ConfigT], unit: Unit) -> bool:
    entry = job.ledger.get(unit.id)
    if entry is None or entry.key != job.keys[unit.id]:
        return False
    if any(refusal.reason in job.options.retry_reasons for refusal in entry.outcome.refusals):
        return False
    return entry.outcome.state != REFUSED or not job.options.retry_refused


def _work(job: _Job[ConfigT], selected: Sequence[Unit]) -> None:
    again = {unit.id for unit in selected}
    standing = [outcome for unit, outcome in job.settled().outcomes.items() if unit not in again]
    count = replace(count_refusals(standing, len(job.units), job.stage.parts_fact), found=None)
    _keep_to_budget(job, count)
    with (
        _serving(job, selected) as server,
        progress(job.stage.name, len(selected), job.options) as tell,
        _reclaiming(job, frozenset(again)) as reclaim,
        _appender(job) as append,
        closing(
            job.engine(
                _batches(selected, job.options.processes),
                partial(_process_batch, job.stage, job.config, StageContext(out=job.out, server=server)),
                job.options.processes,
            )
        ) as outcomes,  # no worker outlives the lock
    ):
        for outcome in outcomes:
            if outcome.unit not in again:  # its task was lost with a machine, and has been done once more
                continue
            again.discard(outcome.unit)
            job.ledger[outcome.unit] = append(LedgerEntry(key=job.keys[outcome.unit], outcome=outcome))
            count = with_outcome(count, outcome)
            tell(outcome)
            _keep_to_budget(job, count)
            reclaim(outcome.unit)


def _serving(job: _Job[ConfigT], selected: Sequence[Unit]) -> AbstractContextManager[str]:
    if job.stage.serve is None or not job.options.gpus or not selected:
        return nullcontext("")
    return job.stage.serve(job.config, job.options.gpus)


def _reclaiming(job: _Job[ConfigT], again: Collection[str]) -> AbstractContextManager[Callable[[str], None]]:
    reads = job.stage.reads
    if reads is None or not job.options.reclaim:
        return nullcontext(_keep)
    done = [name for name in job.settled().outcomes if name not in again]
    return reclaiming(job.units, partial(reads, job.config), done)


def _keep(unit: str) -> None:
    """What is done with the inputs of a unit where nothing is reclaimed."""


def _appender(job: _Job[ConfigT]) -> AbstractContextManager[Callable[[LedgerEntry], LedgerEntry]]:
    """What is reclaimed is deleted after the line that says that it can be: that line must be on disk by then."""
    return ledger_appender(job.out, sync_every_s=0.0) if job.options.reclaim else ledger_appender(job.out)


def _keep_to_budget(job: _Job[ConfigT], count: RefusalCount, extra: Sequence[Refusal] = ()) -> None:
    exceeding = over_budget(job.options.max_refused, count)
    if not exceeding:
        return
    _write_refusals(job, extra)
    first = _refusals(job, extra)[0]
    raise BudgetExceeded(
        f"{job.stage.name}: {exceeding} were refused, more than --max-refused {job.options.max_refused:g} allows; the "
        f"first is {first.unit} ({first.reason}: {first.message}), and all are in {job.out / QUARANTINE_FILE}. Mend "
        "the source, or raise --max-refused and run the same command again: what is done is kept."
    )


def _batches(units: Sequence[Unit], workers: int) -> list[list[Unit]]:
    """Units of one batch together, batches in the order in which they first appear.

    For several workers those of most units come first, so that none is left with a large one at the end.
    """
    batches: dict[tuple[str, str], list[Unit]] = {}
    for unit in units:
        batches.setdefault(("batch", unit.batch) if unit.batch else ("unit", unit.id), []).append(unit)
    ordered = list(batches.values())
    return sorted(ordered, key=len, reverse=True) if workers > 1 else ordered


def _process_batch(
    stage: Stage[ConfigT], config: ConfigT, context: StageContext, batch: Sequence[Unit]
) -> Iterator[Outcome]:
    """Outcomes of one batch, each with the time it took; runs inside a worker."""
    left = {unit.id: unit for unit in batch}
    started = time.perf_counter()
    try:
        with full_disk_named(context.out), gone_folder_named(config, context.out):
            for outcome in stage.process(batch, config, context):
                if left.pop(outcome.unit, None) is None:
                    raise RuntimeError(f"{stage.name} gave an outcome too many, for {outcome.unit}")
                digests = tuple(digest_on_disk(context.out / output) for output in outcome.outputs)
                yield replace(outcome, digests=digests, seconds=time.perf_counter() - started)
                started = time.perf_counter()
    except DataError as error:
        for unit in left.values():
            yield replace(refused(unit, error), seconds=time.perf_counter() - started)
        return
    except MemoryError as error:
        raise WsmError(
            f"memory ran out at {next(iter(left), stage.name)}; what is finished is kept: run the same command again, "
            "with fewer --workers or on a machine with more memory"
        ) from error
    if left:
        raise RuntimeError(f"{stage.name} gave no outcome for {', '.join(left)}")


def _is_finished(job: _Job[ConfigT]) -> bool:
    """Whether `finish` came to its end for these very outcomes and upstream states, and what it wrote is there."""
    old = read_stage_record(job.out)
    if old is None or old.finished != _state(job):
        return False
    return all(is_as_written(job.out / output, digest) for output, digest in old.outputs.items())


def _keep_record_current(job: _Job[ConfigT]) -> None:
    """Inputs may lie elsewhere than when the stage was finished: later stages find them through the record."""
    old = read_stage_record(job.out)
    if old is None:
        return
    new = replace(job.record, finished=old.finished, workers=old.workers, outputs=old.outputs)
    if old != new:
        write_stage_record(job.out, new)


def _state(job: _Job[ConfigT]) -> str:
    settled = job.settled()
    return digest_json(
        [
            *(
                [unit, one.state, one.digest, [str(two.reason) for two in one.refusals]]
                for unit, one in settled.outcomes.items()
            ),
            list(settled.pending),
            dict(job.record.seen),
            dict(job.finish_inputs),
        ]
    )


def _finish(job: _Job[ConfigT]) -> None:
    """Write what belongs to no single unit, the record last."""
    settled = job.settled()
    end = job.stage.finish(job.config, StageContext(out=job.out), settled) if job.stage.finish else Finished()
    outcomes = settled.outcomes.values()
    _keep_to_budget(job, count_refusals(outcomes, len(job.units), job.stage.parts_fact, end.refusals), end.refusals)
    _write_refusals(job, end.refusals)
    compact_ledger(job.out, {unit: job.ledger[unit] for unit in settled.outcomes}, _stale(job))
    write_pending(job.out, settled.pending)
    outputs = {output: digest_on_disk(job.out / output) for output in (PENDING_FILE, QUARANTINE_FILE, *end.outputs)}
    write_stage_record(job.out, replace(job.record, finished=_state(job), outputs=outputs))


def _stale(job: _Job[ConfigT]) -> dict[str, LedgerEntry]:
    """Finished work that is no result now, and may be one again without being done again.

    A unit is not listed when the upstream unit it follows from is pending, such as the trajectories of a container that
    a limited run did not come to; only once nothing is pending before this stage has it left the source.
    """
    settled = job.settled()
    may_return = set(job.ledger) if job.waits_for else set(settled.pending)
    return {unit: entry for unit, entry in job.ledger.items() if unit in may_return and unit not in settled.outcomes}


def _write_refusals(job: _Job[ConfigT], extra: Sequence[Refusal]) -> None:
    write_quarantine(job.out, job.record, _refusals(job, extra))


def _refusals(job: _Job[ConfigT], extra: Sequence[Refusal]) -> list[Refusal]:
    outcomes = job.settled().outcomes.values()
    return [*(refusal for outcome in outcomes for refusal in outcome.refusals), *extra]
