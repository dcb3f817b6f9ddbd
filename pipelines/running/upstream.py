"""How a stage reads the ones before it: through their records and ledgers, never by listing files."""

from collections.abc import Mapping
from pathlib import Path

from pipelines.running.folder import StageRecord, digest_on_disk, read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.quarantine import PENDING_FILE, QUARANTINE_FILE, read_pending, read_quarantine
from pipelines.running.settings import input_fields
from pipelines.running.stage import DONE, Outcome
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.verdict import Refusal

DAMAGED_SUFFIX = ".damaged"


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
    return read_quarantine(vouched_by_record(folder, QUARANTINE_FILE))


def pending_units(folder: Path) -> tuple[str, ...]:
    """Ids of the units that an upstream stage was not asked to work on, or did not come to."""
    return read_pending(vouched_by_record(folder, PENDING_FILE))


def vouched_by_record(folder: Path, output: str) -> Path:
    """A file that a stage wrote at its end, where it is as that stage left it.

    Raises:
        IntegrityError: it is not; what is there is set aside, so that the stage writes it again.
    """
    record = read_stage_record(folder)
    if record is not None and record.finished and output in record.outputs:
        _require_digest(folder, folder / output, record.outputs[output])
    return folder / output


def vouched_by_ledger(folder: Path, outcome: Outcome, path: Path) -> Path:
    """A file that a unit of a stage before wrote, where it is as that unit left it.

    Raises:
        IntegrityError: it is not; what is there is set aside, so that the unit is done again.
    """
    digests = dict(zip(outcome.outputs, outcome.digests, strict=False))
    _require_digest(folder, path, digests.get(str(path.relative_to(folder))))
    return path


def _require_digest(folder: Path, path: Path, digest: str | None) -> None:
    if digest is None or digest_on_disk(path) == digest:
        return
    record = read_stage_record(folder)
    stage = record.name if record else folder.name
    found = f"other bytes, which are kept as {_set_aside(path)}" if path.exists() else "nothing"
    raise IntegrityError(
        f"{path} must hold what `wsm {stage}` wrote, found {found}; run the same commands again from `wsm {stage}` on: "
        "what is missing is made again"
    )


def _set_aside(path: Path) -> str:
    aside = path.with_name(f"{path.name}{DAMAGED_SUFFIX}")
    try:
        path.replace(aside)
    except OSError:  # a folder that may not be written: nothing is lost
        return path.name
    return aside.name
