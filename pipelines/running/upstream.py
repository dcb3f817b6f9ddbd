"""How a stage reads the ones before it: through their records and ledgers, never by listing files."""

from collections.abc import Mapping
from pathlib import Path

from pipelines.running.folder import (
    PENDING_FILE,
    QUARANTINE_FILE,
    StageRecord,
    read_ledger,
    read_stage_record,
    refusal_from_json,
)
from pipelines.running.settings import input_fields
from pipelines.running.stage import DONE, Outcome
from wsm_data.errors import ConfigError
from wsm_data.files.jsonlines import read_lines
from wsm_data.schema.verdict import Refusal


class UpstreamMissing(ConfigError):
    """An upstream stage has not come as far as it must: nothing is wrong with the request but its time."""


def upstream_records(config: object) -> dict[str, StageRecord]:
    """Records of the stages a config takes its inputs from, by the field that names the folder."""
    records = {name: read_stage_record(Path(getattr(config, name))) for name in input_fields(config)}
    return {name: record for name, record in records.items() if record is not None}


def require_stage(folder: Path, name: str) -> StageRecord:
    """The record of an upstream stage that has come to its end and is not older than its own inputs.

    Raises:
        UpstreamMissing: the folder is empty, its stage was cut short, or its output is out of date.
        ConfigError: the folder holds the output of another stage.
    """
    record = read_stage_record(folder)
    if record is None:
        raise UpstreamMissing(f"{folder} must hold the output of `wsm {name}`, found nothing; run `wsm {name}` first")
    if record.name != name:
        found = f"the output of `wsm {record.name}`"
        raise ConfigError(f"{folder} must hold the output of `wsm {name}`, found {found}; run `wsm {name}` first")
    if not record.finished:
        raise UpstreamMissing(
            f"`wsm {name}` has not come to its end in {folder}; run the same command again to resume it"
        )
    for field, seen in record.seen.items():
        upstream = read_stage_record(Path(record.config[field]))
        if upstream is not None and upstream.finished != seen:
            raise UpstreamMissing(f"{folder} is older than its input {record.config[field]}; run `wsm {name}` again")
    return record


def done_outcomes(folder: Path) -> Mapping[str, Outcome]:
    """Outcomes of the units that are done, by unit id, sorted by id."""
    entries = sorted(read_ledger(folder).items())
    return {unit: entry.outcome for unit, entry in entries if entry.outcome.state == DONE}


def quarantine_of(folder: Path) -> tuple[Refusal, ...]:
    """Every refusal an upstream stage wrote down."""
    return tuple(refusal_from_json(line) for line in read_lines(folder / QUARANTINE_FILE))


def pending_units(folder: Path) -> tuple[str, ...]:
    """Ids of the units that an upstream stage was not asked to work on, or did not come to."""
    return tuple(str(line["unit"]) for line in read_lines(folder / PENDING_FILE))
