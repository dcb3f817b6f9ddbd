"""`wsm clean`: what a finished release no longer needs, said with its bytes, and deleted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from pipelines.registry import STAGES, load_stage
from pipelines.running.folder import StageRecord, digest_on_disk, locked
from pipelines.running.given_up import giving_up, present_bytes
from pipelines.running.ledger import LedgerEntry, read_ledger
from pipelines.running.runner import unit_key
from pipelines.running.stage import AnyStage, Unit
from pipelines.running.stage_status import read_stage_folders
from pipelines.running.upstream import DAMAGED_SUFFIX, require_stage
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.typed_toml import build_config
from wsm_data.view.drawing.text_table import aligned

_KNOWN = {entry.name for entry in STAGES}


@dataclass(frozen=True, kw_only=True)
class Spent:
    """Outputs of one stage that a finished stage after it no longer needs.

    Attributes:
        reader: folder of the stage that has read them.
        folder: folder of the stage that made them.
        outputs: the outputs, by unit.
        size_bytes: bytes of those that are there.
    """

    reader: Path
    folder: Path
    outputs: Mapping[str, tuple[str, ...]]
    size_bytes: int


def clean(run: Path, dry_run: bool, yes: bool) -> None:
    """Say what is spent in a run, ask, and delete it; later runs still know what was done.

    Before anything is deleted, what was made of it is read and compared with what its stage wrote.

    Raises:
        ConfigError: the folder is of no run, or nothing in it is finished that has read outputs of another stage.
        IntegrityError: what was made of them is not what its stage wrote.
    """
    records = read_stage_folders(run)
    if not records:
        raise ConfigError(f"{run} must be the folder of a run or of a stage, found no stage.json in it or one below")
    spent = [one for folder, record in records.items() for one in _spent(folder, record)]
    damaged = [path for folder in records for path in sorted(folder.rglob(f"*{DAMAGED_SUFFIX}")) if path.is_file()]
    damaged_bytes = sum(path.stat().st_size for path in damaged)
    total = sum(one.size_bytes for one in spent) + damaged_bytes
    typer.echo(_table(spent, len(damaged), damaged_bytes))
    if dry_run or not total or not (yes or typer.confirm(f"delete {total:,} bytes?")):
        return
    freed = sum(_give_up(one) for one in spent)
    for path in damaged:
        path.unlink(missing_ok=True)
    typer.echo(f"{freed + damaged_bytes:,} bytes were freed")


def _spent(folder: Path, record: StageRecord) -> Iterator[Spent]:
    stage: AnyStage | None = load_stage(record.name) if record.name in _KNOWN else None
    if stage is None or stage.reads is None:
        return
    require_stage(folder, record.name)
    config = build_config(stage.config_type, record.config)
    units = stage.list_units(config)
    _require_settled(folder, record, units)
    for made_in, outputs in stage.reads(config, units).items():
        yield Spent(reader=folder, folder=made_in, outputs=outputs, size_bytes=present_bytes(made_in, outputs))


def _require_settled(folder: Path, record: StageRecord, units: Sequence[Unit]) -> None:
    entries = read_ledger(folder)
    open_units = [one.id for one in units if one.id not in entries or entries[one.id].key != unit_key(record, one)]
    if open_units:
        raise ConfigError(
            f"{folder} must hold everything that its inputs give before they are given up, but {open_units[0]} is "
            f"pending; run `wsm {record.name}` again"
        )


def _give_up(spent: Spent) -> int:
    """Bytes that were freed, after every output that replaces them was read."""
    with locked(spent.reader):
        for entry in read_ledger(spent.reader).values():
            _require_as_written(spent.reader, entry)
        with giving_up(spent.folder) as give_up:
            return give_up(spent.outputs)


def _require_as_written(folder: Path, entry: LedgerEntry) -> None:
    for output, digest in zip(entry.outcome.outputs, entry.outcome.digests, strict=True):
        if digest_on_disk(folder / output) != digest:
            raise IntegrityError(
                f"{folder / output} must be what was written before the only other copy of it is deleted, found other "
                "bytes; nothing was deleted: run the same commands again"
            )


def _table(spent: list[Spent], damaged: int, damaged_bytes: int) -> str:
    rows = [("what", "files", "bytes")]
    for one in spent:
        files = sum((one.folder / name).is_file() for names in one.outputs.values() for name in names)
        rows.append((f"{one.folder}, as it stands in {one.reader}", f"{files:,}", f"{one.size_bytes:,}"))
    if damaged:
        rows.append((f"damaged files that were set aside (*{DAMAGED_SUFFIX})", f"{damaged:,}", f"{damaged_bytes:,}"))
    return aligned(rows, right=(1, 2)) if len(rows) > 1 else "nothing here is there for a finished release alone"
