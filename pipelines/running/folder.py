"""A stage's output folder: stage.json, ledger.jsonl, quarantine.jsonl and the outputs, for one writer at a time.

The ledger is a journal (`wsm_data.files.journal`): a run writes a file of its own, and the first file holds it all
again once the stage has come to its end.
"""

import fcntl
import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, TextIO

from pipelines.running.stage import Outcome
from wsm_data.errors import ConfigError, IntegrityError, Reason
from wsm_data.files.atomic import is_full_disk, write_text
from wsm_data.files.digest import xxh3_128_file
from wsm_data.files.journal import JournalWriter, journal_files, read_journal, rewrite_journal
from wsm_data.files.jsonlines import canonical_json, read_lines, write_lines
from wsm_data.files.sealed import sealed, unsealed
from wsm_data.schema.verdict import Refusal

STAGE_FILE, LEDGER = "stage.json", "ledger"
QUARANTINE_FILE, PENDING_FILE = "quarantine.jsonl", "pending.jsonl"
_SYNC_EVERY_S = 0.2
_CLOCK_STEP_S = 0.001
"""Times are kept in milliseconds; a file is never younger than the line that speaks of it."""


@dataclass(frozen=True, kw_only=True)
class LedgerEntry:
    """The last word on a unit.

    Attributes:
        key: key it was settled under.
        outcome: what became of it.
        sizes: bytes of its outputs when it was settled, in their order; None for what was no file.
        time_s: when it was settled, seconds since 1970.
        stale: the unit is pending by now, or not listed for the time being; its outputs are kept for when it returns.
    """

    key: str
    outcome: Outcome
    sizes: tuple[int | None, ...] = ()
    time_s: float = 0.0
    stale: bool = False


@dataclass(frozen=True, kw_only=True)
class StageRecord:
    """What stage.json holds.

    Attributes:
        name: the stage.
        version: version of the stage that wrote the folder.
        settings: every setting that decides the bytes.
        config: the whole resolved config, input paths included.
        fingerprint: digest of name, version and settings.
        inputs: fingerprint of each upstream stage, by the config field that names it.
        seen: `finished` of each upstream stage when this one was last finished, by the same names.
        units: number of units in the listing.
        workers: worker processes of the last run.
        finished: digest of the outcomes `finish` was last called with; empty before.
        outputs: xxh3_128 of every file that `finish` and the runner wrote at the end, by its name relative to the
            folder; None for a folder.
    """

    name: str
    version: int
    settings: Mapping[str, Any]
    config: Mapping[str, Any]
    fingerprint: str
    inputs: Mapping[str, str]
    seen: Mapping[str, str]
    units: int = 0
    workers: int = 1
    finished: str = ""
    outputs: Mapping[str, str | None] = field(default_factory=dict)


def read_stage_record(folder: Path) -> StageRecord | None:
    """The record of a stage folder, or None where no stage has written yet.

    Raises:
        IntegrityError: stage.json is there but unreadable.
    """
    path = folder / STAGE_FILE
    if not path.exists():
        return None
    try:
        return StageRecord(**unsealed(json.loads(path.read_text())))
    except (ValueError, TypeError) as error:
        raise IntegrityError(
            f"{path} is not a stage record ({error}); delete the folder and run the stage again"
        ) from error


def write_stage_record(folder: Path, record: StageRecord) -> None:
    """Write stage.json atomically."""
    write_text(folder / STAGE_FILE, json.dumps(sealed(vars(record)), indent=2, sort_keys=True) + "\n")


def read_ledger(folder: Path, *, with_stale: bool = False) -> dict[str, LedgerEntry]:
    """The last entry of every unit; stale ones, which are no part of the stage's result, only if they are asked for.

    Raises:
        IntegrityError: a line is damaged, or names an output that does not lie in the folder.
    """
    entries = {str(line["unit"]): _entry_from_line(folder, line) for line in read_journal(folder, LEDGER)}
    return {unit: entry for unit, entry in entries.items() if with_stale or not entry.stale}


def size_on_disk(path: Path) -> int | None:
    """Bytes of a file; None for a folder and for what is not there."""
    return path.stat().st_size if path.is_file() else None


def digest_on_disk(path: Path) -> str | None:
    """xxh3_128 of a file; None for a folder and for what is not there."""
    return xxh3_128_file(path) if path.is_file() else None


def is_as_written(path: Path, digest: str | None) -> bool:
    """Whether an output is still there, with its bytes where their digest is known."""
    return path.exists() if digest is None else digest_on_disk(path) == digest


def is_whole(folder: Path, entry: LedgerEntry) -> bool:
    """Whether the outputs of a unit are as it left them.

    Bytes are compared of files alone that were touched since: a stage may hold terabytes, which are not read to find
    that there is nothing to do. What a disk changes behind the system's back is found by who reads it.
    """
    outputs = entry.outcome.outputs
    unknown = (None,) * len(outputs)
    whole = zip(outputs, entry.sizes or unknown, entry.outcome.digests or unknown, strict=True)
    return all(_is_output(folder / output, size, digest, entry.time_s) for output, size, digest in whole)


def _is_output(path: Path, size: int | None, digest: str | None, time_s: float) -> bool:
    if size is None or not path.is_file():
        return size is None and path.exists()
    found = path.stat()
    return found.st_size == size and (digest is None or found.st_ctime <= time_s or digest_on_disk(path) == digest)


@contextmanager
def ledger_appender(folder: Path) -> Iterator[Callable[[LedgerEntry], LedgerEntry]]:
    """Open the ledger for more outcomes; yields the function that adds one, which then survives a kill.

    That function returns the entry as a later run reads it (a tuple among the facts is a list by then), so that what
    follows cannot depend on whether the run was cut short.
    """
    with JournalWriter(folder, LEDGER, _SYNC_EVERY_S) as journal:

        def append(entry: LedgerEntry) -> LedgerEntry:
            sizes = [size_on_disk(folder / output) for output in entry.outcome.outputs]
            line = {**_ledger_line(entry), "sizes": sizes, "time": round(time.time() + _CLOCK_STEP_S, 3)}
            journal.append(line)
            return _entry_from_line(folder, json.loads(canonical_json(line)))

        yield append


def compact_ledger(folder: Path, settled: Mapping[str, LedgerEntry], stale: Mapping[str, LedgerEntry]) -> None:
    """Keep only the given entries, mark the stale ones, and delete the files that only others wrote.

    Lines keep their text, times included; a ledger of one file in which nothing changes is left alone.

    Raises:
        IntegrityError: a line is damaged, or names an output that does not lie in the folder.
    """
    lines = list(read_journal(folder, LEDGER))
    kept = []
    for unit, line in {str(line["unit"]): line for line in lines}.items():
        plain = {name: value for name, value in line.items() if name != "stale"}
        if unit in settled and settled[unit].key == line["key"]:
            kept.append(plain)
        elif unit in stale and stale[unit].key == line["key"]:
            kept.append({**plain, "stale": True})
    if kept == lines and sum(name == LEDGER for name, _ in journal_files(folder)) <= 1:
        return
    wanted = {output for line in kept for output in _outputs(folder, line)}
    for output in {output for line in lines for output in _outputs(folder, line)} - wanted:
        if (folder / output).is_file():
            (folder / output).unlink()
    rewrite_journal(folder, LEDGER, kept)


def _outputs(folder: Path, line: Mapping[str, Any]) -> tuple[str, ...]:
    """Outputs of a line, which are looked for, and deleted, below the folder: they must not climb out of it."""
    outputs = tuple(line["outputs"])
    for output in outputs:
        path = PurePosixPath(output)
        if path.is_absolute() or ".." in path.parts or not path.parts:
            raise IntegrityError(
                f"{folder}: the ledger must name outputs of unit {line['unit']} inside the folder, found {output!r}; "
                "restore the ledger, or delete the folder and run the stage again"
            )
    return outputs


def _ledger_line(entry: LedgerEntry) -> dict[str, Any]:
    outcome = entry.outcome
    return {
        "unit": outcome.unit,
        "key": entry.key,
        "state": outcome.state,
        "digest": outcome.digest,
        "outputs": list(outcome.outputs),
        "facts": dict(outcome.facts),
        "refusals": [refusal_json(refusal) for refusal in outcome.refusals],
        "seconds": round(outcome.seconds, 4),
        "digests": list(outcome.digests),
    }


def write_quarantine(folder: Path, record: StageRecord, refusals: Iterable[Refusal]) -> None:
    """Write all refusals of the stage, sorted by unit, replacing what an earlier state of the inputs left.

    A refusal that stood there before keeps its time.
    """
    path = folder / QUARANTINE_FILE
    seen = {(line["unit"], line["reason"], line["message"]): line["time"] for line in read_lines(path)}
    stage = {"stage": record.name, "stage_version": record.version, "fingerprint": record.fingerprint}
    lines = []
    for refusal in sorted(refusals, key=lambda one: (one.unit, one.source, one.reason)):
        line = {**refusal_json(refusal), **stage}
        identity = (line["unit"], line["reason"], line["message"])
        lines.append({**line, "time": seen.get(identity, round(time.time(), 3))})
    write_lines(path, lines)


def refusal_json(refusal: Refusal) -> dict[str, Any]:
    """JSON object of a refusal."""
    return {**vars(refusal), "reason": str(refusal.reason), "details": dict(refusal.details)}


def refusal_from_json(record: Mapping[str, Any]) -> Refusal:
    """Inverse of `refusal_json`; keys the runner added are passed over."""
    names = ("unit", "source", "message", "details")
    return Refusal(reason=Reason(record["reason"]), **{name: record[name] for name in names})


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder against a second writer; the lock falls with the process, however it ends.

    Raises:
        ConfigError: another process holds it, or there can be no such folder.
    """
    with _lock_file(folder) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ConfigError(
                f"{folder} is being written by another wsm process; wait for it, or use another --out"
            ) from error
        yield


def _lock_file(folder: Path) -> TextIO:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return (folder / ".lock").open("w")
    except OSError as error:
        if is_full_disk(error):  # no fault of the request
            raise
        raise ConfigError(f"{folder} must be a folder that can be written ({error}); use another --out") from error


def _entry_from_line(folder: Path, line: Mapping[str, Any]) -> LedgerEntry:
    outcome = Outcome(
        unit=line["unit"],
        state=line["state"],
        digest=line["digest"],
        outputs=_outputs(folder, line),
        facts=line["facts"],
        refusals=tuple(refusal_from_json(record) for record in line["refusals"]),
        seconds=line["seconds"],
        digests=tuple(line.get("digests", ())),
    )
    sizes = tuple(line.get("sizes", ()))
    time_s = line.get("time", 0.0)
    return LedgerEntry(key=line["key"], outcome=outcome, sizes=sizes, time_s=time_s, stale=line.get("stale", False))
