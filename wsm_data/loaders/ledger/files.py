"""The files of a ledger: journals (`wsm_data.files.journal`), one a rank, with a file for each of its processes.

The first record of a file says who writes: the session, its rank, and what decides the order of the run. Then a record
with `start` says that steps follow from (epoch, start) on, and how many the epoch has; one with `refs` which clips a
step brought; `closed` that the writer was closed.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wsm_data.errors import IntegrityError
from wsm_data.files.journal import file_name, journal_files, read_records, torn_bytes

LEDGER_VERSION = 2
_RANK = re.compile(r"rank-([0-9]{5,})")


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """Steps that one rank recorded one after the other, from one start on.

    Attributes:
        epoch: the epoch.
        start: step it starts from.
        steps: steps the whole epoch has.
        refs: refs of the steps start, start + 1, ... as they were delivered; int64 [N] each.
    """

    epoch: int
    start: int
    steps: int
    refs: tuple[NDArray[np.int64], ...]

    @property
    def end(self) -> int:
        """The step after the last recorded one."""
        return self.start + len(self.refs)


@dataclass(frozen=True, kw_only=True, eq=False)
class LedgerFile:
    """What one process recorded.

    Attributes:
        path: the file.
        session: id of the process's session.
        identity: what decides the order, as JSON.
        rank: its rank.
        world_size: number of ranks.
        segments: in the order in which they were recorded.
        closed: whether the writer was closed; otherwise it was killed, or still writes.
        torn_bytes: bytes behind the last whole record: of one that was not written to its end.
    """

    path: Path
    session: str
    identity: Mapping[str, Any]
    rank: int
    world_size: int
    segments: tuple[Segment, ...]
    closed: bool
    torn_bytes: int


def journal_name(rank: int) -> str:
    """Name of the journal of a rank."""
    return f"rank-{rank:05d}"


def ledger_file_name(rank: int, number: int) -> str:
    """Name of the file that is number `number` of a rank's."""
    return file_name(journal_name(rank), number)


def ledger_files(folder: Path) -> dict[tuple[int, int], Path]:
    """The files of a ledger by (rank, number), in that order: the processes of a rank by number, without a clock.

    Raises:
        IntegrityError: the ledger is of an older version.
    """
    if old := next(folder.glob("rank-*.ledger"), None):
        raise IntegrityError(
            f"{old} is of an older version of the ledger, {LEDGER_VERSION} is needed; use the wsm that wrote it, or "
            "give the run another folder for its ledger"
        )
    files = journal_files(folder).items()
    named = [(match, number, path) for (name, number), path in files if (match := _RANK.fullmatch(name))]
    return dict(sorted(((int(match[1]), number), path) for match, number, path in named))


def read_session(path: Path) -> dict[str, Any] | None:
    """The head of a file; None where its writer was killed before the head was whole.

    Raises:
        IntegrityError: it is damaged, or of another version.
    """
    session = next(read_records(path), None)
    if session is not None and session.get("version") != LEDGER_VERSION:
        raise IntegrityError(
            f"{path} must start with the head of a ledger of version {LEDGER_VERSION}, found "
            f"{session.get('version', 'none')}; restore the file or use a matching wsm"
        )
    return session


def read_ledger_file(path: Path) -> LedgerFile | None:
    """All of a file; None where its writer was killed before the head was whole.

    Raises:
        IntegrityError: it is damaged other than by a kill, or of another version.
    """
    session = read_session(path)
    if session is None:
        return None
    _, *records = read_records(path)
    return LedgerFile(
        path=path,
        session=session["session"],
        identity=session["identity"],
        rank=session["rank"],
        world_size=session["world_size"],
        segments=_segments(records, path),
        closed=bool(records) and "closed" in records[-1],
        torn_bytes=torn_bytes(path),
    )


def _segments(records: Iterable[Mapping[str, Any]], path: Path) -> tuple[Segment, ...]:
    segments: list[tuple[Mapping[str, Any], list[NDArray[np.int64]]]] = []
    for record in records:
        if "start" in record:
            segments.append((record, []))
        elif "refs" in record:
            begun, refs = segments[-1] if segments else ({"epoch": -1, "start": 0, "steps": 0}, [])
            _require_next(record, begun, begun["start"] + len(refs), path)
            refs.append(np.array(record["refs"], np.int64))
    return tuple(
        Segment(epoch=begun["epoch"], start=begun["start"], steps=begun["steps"], refs=tuple(refs))
        for begun, refs in segments
    )


def _require_next(record: Mapping[str, Any], begun: Mapping[str, Any], step: int, path: Path) -> None:
    if (record["epoch"], record["step"]) != (begun["epoch"], step) or step >= begun["steps"]:
        raise IntegrityError(
            f"{path}: step {step} of epoch {begun['epoch']} must follow, found step {record['step']} of epoch "
            f"{record['epoch']}; restore the file"
        )
