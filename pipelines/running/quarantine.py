"""What a stage refused, a line each, and which of its units are pending: files that it writes at its end."""

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from pipelines.running.folder import StageRecord
from wsm_data.files.json_values import load_json_lines, to_json
from wsm_data.files.jsonlines import write_lines
from wsm_data.schema.verdict import Refusal

QUARANTINE_FILE, PENDING_FILE = "quarantine.jsonl", "pending.jsonl"
_REMEDY = "restore the file, or delete the folder and run the stage again"


@dataclass(frozen=True, kw_only=True)
class _Line(Refusal):
    """A refusal as a stage writes it down.

    Attributes:
        stage: the stage.
        stage_version: its version.
        fingerprint: digest of its name, version and settings.
        time: when it was first refused so, seconds since 1970.
    """

    stage: str
    stage_version: int
    fingerprint: str
    time: float


@dataclass(frozen=True, kw_only=True)
class _Pending:
    unit: str


def write_quarantine(folder: Path, record: StageRecord, refusals: Iterable[Refusal]) -> None:
    """Write all refusals of the stage, sorted by unit, replacing what an earlier state of the inputs left.

    A refusal that stood there before keeps its time.

    Raises:
        IntegrityError: a line that stands there is none of a refusal.
    """
    path = folder / QUARANTINE_FILE
    seen = {_identity(line): line.time for line in _lines(path)}
    now = round(time.time(), 3)
    stage = {"stage": record.name, "stage_version": record.version, "fingerprint": record.fingerprint}
    in_order = sorted(refusals, key=lambda one: (one.unit, one.source, one.reason))
    write_lines(path, [{**to_json(one), **stage, "time": seen.get(_identity(one), now)} for one in in_order])


def read_quarantine(path: Path) -> tuple[Refusal, ...]:
    """Every refusal of a stage; none where there is no file.

    Raises:
        IntegrityError: a line is none of a refusal.
    """
    names = [field.name for field in fields(Refusal)]
    return tuple(Refusal(**{name: getattr(line, name) for name in names}) for line in _lines(path))


def write_pending(folder: Path, units: Sequence[str]) -> None:
    """Write the units that are listed and not settled."""
    write_lines(folder / PENDING_FILE, [to_json(_Pending(unit=unit)) for unit in units])


def read_pending(path: Path) -> tuple[str, ...]:
    """Units that were listed and not settled; none where there is no file.

    Raises:
        IntegrityError: a line is none of a unit.
    """
    return tuple(line.unit for line in load_json_lines(_Pending, path, "a pending unit", _REMEDY))


def _lines(path: Path) -> Iterator[_Line]:
    return load_json_lines(_Line, path, "a refusal", _REMEDY)


def _identity(refusal: Refusal) -> tuple[str, str, str]:
    return refusal.unit, refusal.reason, refusal.message
