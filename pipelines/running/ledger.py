"""The ledger of a stage: the last word on every unit, in a journal (`wsm_data.files.journal`).

A run writes a file of its own, and the first file holds it all again once the stage has come to its end.
"""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from pipelines.running.folder import digest_on_disk, size_on_disk
from pipelines.running.stage import Outcome
from wsm_data.errors import IntegrityError
from wsm_data.files.journal import JournalWriter, journal_files, read_journal, rewrite_journal
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.jsonlines import canonical_json

LEDGER = "ledger"
_SYNC_EVERY_S = 0.2
_CLOCK_STEP_S = 0.001
"""Times are kept in milliseconds; a file is never younger than the line that speaks of it."""


@dataclass(frozen=True, kw_only=True)
class LedgerEntry:
    """The last word on a unit. Its line holds the fields of the outcome beside its own.

    Attributes:
        key: key it was settled under.
        outcome: what became of it.
        sizes: bytes of its outputs when it was settled, in their order; None for what was no file.
        time: when it was settled, seconds since 1970.
        stale: the unit is pending by now, or not listed for the time being; its outputs are kept for when it returns.
        given_up: those of its outputs that nothing needs any more: the unit is done whether they are there or not.
    """

    key: str
    outcome: Outcome
    sizes: tuple[int | None, ...] = ()
    time: float = 0.0
    stale: bool = False
    given_up: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        outputs = len(self.outcome.outputs)
        if others := set(self.given_up) - set(self.outcome.outputs):
            raise ValueError(f"given_up must name outputs of the unit, found {', '.join(sorted(others))}")
        for name, values in (("sizes", self.sizes), ("digests", self.outcome.digests)):
            if values and len(values) != outputs:
                raise ValueError(f"{name} must be of the {outputs} outputs, found {len(values)}")


_LEFT_OUT_WHEN_EMPTY = ("stale", "given_up")
_OF_OUTCOME = {field.name for field in fields(Outcome)}


def read_ledger(folder: Path, *, with_stale: bool = False) -> dict[str, LedgerEntry]:
    """The last entry of every unit; stale ones, which are no part of the stage's result, only if they are asked for.

    Raises:
        IntegrityError: a line is damaged, or holds no entry.
    """
    entries = {entry.outcome.unit: entry for entry in _entries(folder)}
    return {unit: entry for unit, entry in entries.items() if with_stale or not entry.stale}


def is_whole(folder: Path, entry: LedgerEntry) -> bool:
    """Whether the outputs of a unit, but those that were given up, are as it left them.

    Bytes are compared of files alone that were touched since: a stage may hold terabytes, which are not read to find
    that there is nothing to do. What a disk changes behind the system's back is found by who reads it.
    """
    outputs = entry.outcome.outputs
    unknown = (None,) * len(outputs)
    whole = zip(outputs, entry.sizes or unknown, entry.outcome.digests or unknown, strict=True)
    return all(
        output in entry.given_up or _is_output(folder / output, size, digest, entry.time)
        for output, size, digest in whole
    )


@contextmanager
def ledger_amender(folder: Path) -> Iterator[Callable[[Iterable[LedgerEntry]], None]]:
    """Open the ledger for other words on units that are settled; yields the function that brings entries to disk."""
    with JournalWriter(folder, LEDGER) as journal:

        def amend(entries: Iterable[LedgerEntry]) -> None:
            for entry in entries:
                journal.append(_line(entry))
            journal.sync()

        yield amend


@contextmanager
def ledger_appender(
    folder: Path, sync_every_s: float = _SYNC_EVERY_S
) -> Iterator[Callable[[LedgerEntry], LedgerEntry]]:
    """Open the ledger for more outcomes; yields the function that adds one, which then survives a kill.

    It survives a power cut after `sync_every_s` (0: at once).

    That function returns the entry as a later run reads it (a tuple among the facts is a list by then), so that what
    follows cannot depend on whether the run was cut short.
    """
    with JournalWriter(folder, LEDGER, sync_every_s) as journal:

        def append(entry: LedgerEntry) -> LedgerEntry:
            sizes = tuple(size_on_disk(folder / output) for output in entry.outcome.outputs)
            line = _line(replace(entry, sizes=sizes, time=round(time.time() + _CLOCK_STEP_S, 3)))
            journal.append(line)
            return _entry(folder, json.loads(canonical_json(line)))

        yield append


def compact_ledger(folder: Path, settled: Mapping[str, LedgerEntry], stale: Mapping[str, LedgerEntry]) -> None:
    """Keep only the given entries, mark the stale ones, and delete the files that only others wrote.

    A ledger of one file in which nothing changes is left alone.

    Raises:
        IntegrityError: a line is damaged, or holds no entry.
    """
    entries = list(_entries(folder))
    kept = []
    for unit, entry in {entry.outcome.unit: entry for entry in entries}.items():
        for wanted, is_stale in ((settled, False), (stale, True)):
            if unit in wanted and wanted[unit].key == entry.key:
                kept.append(replace(entry, stale=is_stale))
                break
    if kept == entries and sum(name == LEDGER for name, _ in journal_files(folder)) <= 1:
        return
    for output in _outputs(entries) - _outputs(kept):
        if (folder / output).is_file():
            (folder / output).unlink()
    rewrite_journal(folder, LEDGER, map(_line, kept))


def _outputs(entries: list[LedgerEntry]) -> set[str]:
    return {output for entry in entries for output in entry.outcome.outputs}


def _is_output(path: Path, size: int | None, digest: str | None, time_s: float) -> bool:
    if size is None or not path.is_file():
        return size is None and path.exists()
    found = path.stat()
    return found.st_size == size and (digest is None or found.st_ctime <= time_s or digest_on_disk(path) == digest)


def _entries(folder: Path) -> Iterator[LedgerEntry]:
    return (_entry(folder, line) for line in read_journal(folder, LEDGER))


def _line(entry: LedgerEntry) -> dict[str, Any]:
    line = to_json(entry)
    outcome = {**line.pop("outcome"), "seconds": round(entry.outcome.seconds, 4)}
    return {**outcome, **{name: value for name, value in line.items() if name not in _LEFT_OUT_WHEN_EMPTY or value}}


def _entry(folder: Path, line: Mapping[str, Any]) -> LedgerEntry:
    outcome = {name: value for name, value in line.items() if name in _OF_OUTCOME}
    rest = {name: value for name, value in line.items() if name not in _OF_OUTCOME}
    try:
        return from_json(LedgerEntry, {"outcome": outcome, **rest}, complete=False)
    except ValueError as error:
        raise IntegrityError(
            f"{folder}: every line of the ledger must hold what became of a unit, but that of unit "
            f"{line.get('unit')!r} does not: {error}; restore the ledger, or delete the folder and run the stage again"
        ) from error
