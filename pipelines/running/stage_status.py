"""Where a stage stands, read from its folder while it is written or afterwards; nothing is locked or changed."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.running.folder import STAGE_FILE, StageRecord, read_stage_record
from pipelines.running.ledger import LedgerEntry, read_ledger
from pipelines.running.lock_holder import Locks, lock_holder
from pipelines.running.quarantine import QUARANTINE_FILE, read_quarantine
from pipelines.running.stage import Settled
from pipelines.running.stage_report import beyond_outcomes, stage_report
from wsm_data.errors import IntegrityError

FINISHED, RUNNING, UNFINISHED = "finished", "running", "unfinished"
_SLOWEST = 3
_ATTEMPTS = 5


@dataclass(frozen=True, kw_only=True)
class UnitTime:
    """Seconds that a unit took."""

    unit: str
    seconds: float


@dataclass(frozen=True, kw_only=True)
class StageStatus:
    """Where a stage stands.

    Attributes:
        stage: name of its folder, which is that of the stage but after a fork.
        state: `running` while a process of this machine writes it, `finished` once it came to its end, else
            `unfinished`: it was interrupted or failed, or a process of another machine writes it.
        writer: id of the process of this machine that holds the folder's lock.
        listed: units of the inputs when it was last begun.
        done: units that are done. While it is not finished, one whose input changed counts until it is done again.
        refused: units that are refused.
        pending: units that are neither. There is no line for a unit that failed: a failure ends the stage, and the unit
            is pending.
        refused_parts: refused parts of units that are done, and what the end of the stage refused.
        refusals: number of refusals by reason; refused parts count too.
        unit_seconds: sum of the times of the units, which several workers share.
        per_s: units settled per second since the stage was last begun; None once it is finished, and while none is.
        remaining_s: time for all that is pending at this rate.
        slowest: the units that took the longest, the longest first; none where no unit is timed.
    """

    stage: str
    state: str
    writer: int | None
    listed: int
    done: int
    refused: int
    pending: int
    refused_parts: int = 0
    refusals: Mapping[str, int] = field(default_factory=dict)
    unit_seconds: float = 0.0
    per_s: float | None = None
    remaining_s: float | None = None
    slowest: tuple[UnitTime, ...] = ()


def stage_status(folder: Path, record: StageRecord, locks: Locks) -> StageStatus:
    """Where the stage of a folder stands by its ledger; a last line that its writer did not end yet is passed over.

    Raises:
        IntegrityError: a line of the ledger or the quarantine is damaged.
    """
    entries = _read_entries(folder)
    settled = Settled(outcomes={unit: entry.outcome for unit, entry in entries.items()})
    writer = lock_holder(folder, locks)
    finished = bool(record.finished)
    extra = beyond_outcomes(settled, read_quarantine(folder / QUARANTINE_FILE)) if finished else []
    counts = stage_report(record.name, folder, settled, (), 0.0, extra)
    pending = max(record.units - len(entries), 0)
    per_s = None if finished else _units_per_s(folder, entries, writer is not None)
    return StageStatus(
        stage=folder.name,
        state=RUNNING if writer is not None else FINISHED if finished else UNFINISHED,
        writer=writer,
        listed=record.units,
        done=counts.done,
        refused=counts.refused,
        pending=pending,
        refused_parts=counts.refused_parts,
        refusals=counts.refusals,
        unit_seconds=round(sum(entry.outcome.seconds for entry in entries.values()), 4),
        per_s=per_s,
        remaining_s=pending / per_s if per_s else None,
        slowest=_slowest(entries),
    )


def read_stage_folders(run: Path) -> dict[Path, StageRecord]:
    """The folder itself where a stage wrote it, else those of stages in it, by their names."""
    folders = [run] if (run / STAGE_FILE).exists() else sorted(path.parent for path in run.glob(f"*/{STAGE_FILE}"))
    records = {folder: read_stage_record(folder) for folder in folders}
    return {folder: record for folder, record in records.items() if record is not None}


def _read_entries(folder: Path) -> dict[str, LedgerEntry]:
    """The ledger; read again where its writer, coming to the end, made one file of all in the meantime."""
    for _ in range(_ATTEMPTS):
        try:
            return read_ledger(folder)
        except FileNotFoundError:
            continue
    raise IntegrityError(f"{folder}: files of its ledger were deleted each time it was read; find out who deletes them")


def _units_per_s(folder: Path, entries: Mapping[str, LedgerEntry], running: bool) -> float | None:
    """The record is written when a stage begins, and again at its end alone."""
    began = (folder / STAGE_FILE).stat().st_mtime
    times = [entry.time for entry in entries.values() if entry.time >= began]
    if not times:
        return None
    return len(times) / max((time.time() if running else max(times)) - began, 1e-3)


def _slowest(entries: Mapping[str, LedgerEntry]) -> tuple[UnitTime, ...]:
    timed = [UnitTime(unit=unit, seconds=one.outcome.seconds) for unit, one in entries.items() if one.outcome.seconds]
    return tuple(sorted(timed, key=lambda one: (-one.seconds, one.unit))[:_SLOWEST])
