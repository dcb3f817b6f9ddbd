"""`wsm status`: where the stages of a run stand, as a table or as JSON."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from pipelines.operations.prometheus import prometheus_text
from pipelines.registry import STAGES
from pipelines.running.lock_holder import held_locks
from pipelines.running.stage_status import StageStatus, read_stage_folders, stage_status
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.json_values import to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.view.drawing.text_table import aligned

_WATCH_EVERY_S = 2.0
_NAMES = tuple(entry.name for entry in STAGES)


@dataclass(frozen=True, kw_only=True)
class RunStatus:
    """Where a run stands.

    Attributes:
        run: its folder.
        locks_visible: whether this system shows which process holds a folder; no stage counts as running where not.
        stages: the stages that were begun, in the order of the flow.
    """

    run: Path
    locks_visible: bool
    stages: tuple[StageStatus, ...]


def show_status(run: Path, as_json: bool, watch: bool, prometheus: Path | None = None) -> None:
    """Print where a run, or one stage, stands; with `watch` again every two seconds, until it is interrupted.

    Each time the file `prometheus` is replaced by the same numbers for Prometheus.

    Raises:
        ConfigError: the folder is of no run.
        IntegrityError: a record, a ledger or a quarantine is damaged.
    """
    while True:
        status = run_status(run)
        typer.echo(canonical_json(to_json(status)) if as_json else status_text(status))
        if prometheus is not None:
            write_text(prometheus, prometheus_text(str(run), status.stages))
        if not watch:
            return
        time.sleep(_WATCH_EVERY_S)


def run_status(run: Path) -> RunStatus:
    """Read where the stages of a run stand; a run folder or the folder of one stage is given.

    Raises:
        ConfigError: the folder is of no run.
        IntegrityError: a record, a ledger or a quarantine is damaged.
    """
    records = read_stage_folders(run)
    if not records:
        raise ConfigError(f"{run} must be the folder of a run or of a stage, found no stage.json in it or one below")
    locks = held_locks()
    places = {folder: _place(record.name) for folder, record in records.items()}
    stages = [stage_status(one, records[one], locks or {}) for one in sorted(records, key=lambda one: places[one])]
    return RunStatus(run=run, locks_visible=locks is not None, stages=tuple(stages))


def status_text(status: RunStatus) -> str:
    """The stages as an aligned table; below it refusals by reason, and the slowest units."""
    header = ("stage", "state", "units", "done", "refused", "pending", "units/s", "left", "process")
    rows = [header, *(_row(stage) for stage in status.stages)]
    reasons = [
        f"  {stage.stage}: {count} x {reason}" for stage in status.stages for reason, count in stage.refusals.items()
    ]
    slowest = [f"  {stage.stage}: {one.unit} {one.seconds:.1f} s" for stage in status.stages for one in stage.slowest]
    return "\n".join(
        [
            aligned(rows, right=range(2, 8)),
            *_titled("refused, by reason:", reasons),
            *_titled("slowest units:", slowest),
            *([] if status.locks_visible else ["this system does not show which process holds a folder"]),
        ]
    )


def _place(stage: str) -> int:
    return _NAMES.index(stage) if stage in _NAMES else len(_NAMES)


def _titled(title: str, lines: Sequence[str]) -> list[str]:
    return [title, *lines] if lines else []


def _row(stage: StageStatus) -> tuple[str, ...]:
    refused = f"{stage.refused} + {stage.refused_parts} parts" if stage.refused_parts else str(stage.refused)
    rate = "" if stage.per_s is None else f"{stage.per_s:.3g}"
    left = "" if stage.remaining_s is None else _clock(stage.remaining_s)
    writer = "" if stage.writer is None else str(stage.writer)
    counts = (str(stage.listed), str(stage.done), refused, str(stage.pending))
    return stage.stage, stage.state, *counts, rate, left, writer


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
