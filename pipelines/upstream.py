"""How a stage reads the one before it: through its record and ledger, never by listing files."""

from collections.abc import Mapping
from pathlib import Path

from pipelines.folder import QUARANTINE_FILE, StageRecord, read_ledger, read_stage_record, refusal_from_json
from pipelines.stage import DONE, Outcome
from wsm_data.errors import ConfigError
from wsm_data.files.jsonlines import read_lines
from wsm_data.schema.verdict import Refusal


def require_stage(folder: Path, name: str) -> StageRecord:
    """The record of an upstream stage whose last run came to its end.

    Raises:
        ConfigError: the folder holds no output of that stage, or one that was cut short before it was finished.
    """
    record = read_stage_record(folder)
    if record is None or record.name != name:
        found = "nothing" if record is None else f"the output of `wsm {record.name}`"
        raise ConfigError(f"{folder} must hold the output of `wsm {name}`, found {found}; run `wsm {name}` first")
    if not record.finished:
        raise ConfigError(f"`wsm {name}` has not come to its end in {folder}; run the same command again to resume it")
    return record


def done_outcomes(folder: Path) -> Mapping[str, Outcome]:
    """Outcomes of the units that are done, by unit id, sorted by id."""
    entries = sorted(read_ledger(folder).items())
    return {unit: entry.outcome for unit, entry in entries if entry.outcome.state == DONE}


def quarantine_of(folder: Path) -> tuple[Refusal, ...]:
    """Every refusal an upstream stage wrote down."""
    return tuple(refusal_from_json(line) for line in read_lines(folder / QUARANTINE_FILE))
