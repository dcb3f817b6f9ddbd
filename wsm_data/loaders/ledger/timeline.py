"""What a ledger says happened: the steps of each epoch that count, whatever was killed, resumed and started again.

Each rank's files are in order by their number, so no clock is compared. A start at (epoch, step) overrides everything
that was recorded from there on before: those steps were lost with the run that was killed. Rank 0 takes part in every
session, so its starts are the timeline; the other ranks must have recorded the same stretch, from the same start on.
Ranks share no name of their session, which would need communication: a rank's latest start of the same world size at
the same place stands for it, whichever session it is of. Whatever it recorded must still be what the order says.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.ledger.files import LedgerFile, Segment, ledger_file_name, ledger_files, read_ledger_file


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """Steps `start` to `end` of an epoch that count, as the ranks of one world size recorded them.

    Attributes:
        epoch: the epoch.
        start: first step.
        end: step after the last one.
        steps: steps the whole epoch has.
        session: session of rank 0.
        segments: what each rank recorded, by rank, from `start` on; may reach beyond `end`. Empty where a rank is
            missing.
    """

    epoch: int
    start: int
    end: int
    steps: int
    session: str
    segments: tuple[Segment, ...]

    def refs(self, step: int) -> tuple[NDArray[np.int64], ...]:
        """What each rank was given at a step, by rank."""
        return tuple(segment.refs[step - self.start] for segment in self.segments)


@dataclass(frozen=True, kw_only=True)
class Again:
    """Steps `start` to `end` of an epoch that a session recorded, and that a later start brought once more."""

    epoch: int
    start: int
    end: int
    session: str


@dataclass(frozen=True, kw_only=True, eq=False)
class EpochRecord:
    """One epoch as it was recorded.

    Attributes:
        epoch: the epoch.
        steps: steps the whole epoch has.
        stretches: what counts, in order of the steps.
    """

    epoch: int
    steps: int
    stretches: tuple[Stretch, ...]

    @property
    def start(self) -> int:
        """First step that counts."""
        return self.stretches[0].start

    @property
    def recorded(self) -> int:
        """Steps that count."""
        return sum(stretch.end - stretch.start for stretch in self.stretches)

    def by_step(self) -> Iterator[tuple[int, tuple[NDArray[np.int64], ...]]]:
        """Every step that counts, with the refs of each rank."""
        for stretch in self.stretches:
            yield from ((step, stretch.refs(step)) for step in range(stretch.start, stretch.end))


@dataclass(frozen=True, kw_only=True, eq=False)
class Timeline:
    """A whole ledger, put in order.

    Attributes:
        identity: what decides the order, as JSON; the same in all files.
        files: every file.
        epochs: in order.
        again: steps that were recorded and then trained again, as rank 0 recorded them.
        ahead: steps of rank 0 at the end of the last session that another rank has not recorded.
        misfits: what contradicts one uninterrupted course, in sentences; empty where nothing does.
    """

    identity: Mapping[str, Any]
    files: tuple[LedgerFile, ...]
    epochs: tuple[EpochRecord, ...]
    again: tuple[Again, ...]
    ahead: int
    misfits: tuple[str, ...]


def read_timeline(folder: Path) -> Timeline:
    """Read a ledger and put it in order. It may have been switched on in mid-run: it begins at the first start then.

    Raises:
        ConfigError: the folder holds no ledger.
        IntegrityError: a file is damaged, or files of different runs lie together.
    """
    files = _read_files(folder)
    started = [(file, segment) for file in files if file.rank == 0 for segment in file.segments]
    ends = _live_ends([segment for _, segment in started])
    latest = {_start_of(file, segment): segment for file in files for segment in file.segments}
    stretches: list[Stretch] = []
    misfits: list[str] = []
    for (file, segment), end in zip(started, ends, strict=True):
        if end is not None:
            stretch = _stretch(file, segment, end, latest)
            stretches.append(stretch)
            if stretch.end < end and file is started[-1][0] and _stopped_there(stretch, files):
                break  # the last session was killed, or goes on, in this step
            misfits += _missing_ranks(file, segment, end, latest)
    return Timeline(
        identity=files[0].identity,
        files=files,
        epochs=_epochs(stretches),
        again=tuple(_again(started, ends)),
        ahead=_counted((segment.start, end) for (_, segment), end in zip(started, ends, strict=True) if end is not None)
        - _counted((one.start, one.end) for one in stretches),
        misfits=(*_missing_files(folder), *misfits, *_gaps(stretches)),
    )


def steps_text(start: int, end: int) -> str:
    """The steps from `start` on before `end`, in words that name the first and the last."""
    return f"step {start}" if end == start + 1 else f"steps {start} to {end - 1}"


def _read_files(folder: Path) -> tuple[LedgerFile, ...]:
    read = [read_ledger_file(path) for path in ledger_files(folder).values()]
    files = tuple(file for file in read if file is not None)
    if not files:
        raise ConfigError(f"there is no ledger in {folder}; give the folder that the loader was given as `ledger`")
    for file in files:
        if file.identity != files[0].identity:
            raise IntegrityError(
                f"{file.path} and {files[0].path} are of different runs; give each a ledger of its own"
            )
    return files


def _missing_files(folder: Path) -> Iterator[str]:
    """A rank numbers its files from 0 on, so that one that was taken away is missed, unless it is the last."""
    present = ledger_files(folder)
    for rank, number in present:
        if number and (rank, number - 1) not in present:
            name, earlier = ledger_file_name(rank, number), ledger_file_name(rank, number - 1)
            yield f"{earlier} must be in the ledger, as {name} is, but it is not there; restore the file"


def _live_ends(segments: Sequence[Segment]) -> list[int | None]:
    """For each of a rank's segments, where the part that no later start overrides ends; None where nothing is left."""
    ends: list[int | None] = []
    bound: tuple[int, int] | None = None  # the earliest of the later starts
    for segment in reversed(segments):
        start = (segment.epoch, segment.start)
        if bound is not None and bound <= start:
            ends.append(None)
        else:
            cut = bound is not None and bound[0] == segment.epoch
            ends.append(min(segment.end, bound[1]) if bound is not None and cut else segment.end)
            bound = start
    return ends[::-1]


def _start_of(file: LedgerFile, segment: Segment, rank: int | None = None) -> tuple[int, ...]:
    """What the segments of all ranks of a session have in common, and the rank (default: that of the file)."""
    return file.world_size, segment.epoch, segment.start, segment.steps, file.rank if rank is None else rank


def _stretch(file: LedgerFile, segment: Segment, end: int, latest: Mapping[tuple[int, ...], Segment]) -> Stretch:
    """What counts of a segment of rank 0: the steps up to `end` that all ranks recorded."""
    found = [latest.get(_start_of(file, segment, rank)) for rank in range(file.world_size)]
    ranks = tuple(one for one in found if one is not None)
    whole = len(ranks) == len(found)
    return Stretch(
        epoch=segment.epoch,
        start=segment.start,
        end=min(end, *(one.end for one in ranks)) if whole else segment.start,
        steps=segment.steps,
        session=file.session,
        segments=ranks if whole else (),
    )


def _stopped_there(stretch: Stretch, files: Sequence[LedgerFile]) -> bool:
    """Whether the ranks that did not come further recorded nothing after it."""
    final = {id(file.segments[-1]) for file in {file.rank: file for file in files if file.segments}.values()}
    return all(id(segment) in final for segment in stretch.segments if segment.end == stretch.end)


def _counted(ranges: Iterable[tuple[int, int]]) -> int:
    return sum(end - start for start, end in ranges)


def _missing_ranks(
    file: LedgerFile, segment: Segment, end: int, latest: Mapping[tuple[int, ...], Segment]
) -> Iterator[str]:
    for rank in range(file.world_size):
        found = latest.get(_start_of(file, segment, rank))
        if end > segment.start and (found is None or found.end < end):
            reached = "has no such start" if found is None else f"stops before {found.end}"
            yield (
                f"epoch {segment.epoch}: all {file.world_size} ranks must have recorded "
                f"{steps_text(segment.start, end)} from a start at {segment.start} of {segment.steps} on, but rank "
                f"{rank} {reached}"
            )


def _epochs(stretches: Sequence[Stretch]) -> tuple[EpochRecord, ...]:
    grouped = [(epoch, tuple(parts)) for epoch, parts in groupby(stretches, key=lambda one: one.epoch)]
    return tuple(EpochRecord(epoch=epoch, steps=parts[0].steps, stretches=parts) for epoch, parts in grouped)


def _again(started: Sequence[tuple[LedgerFile, Segment]], ends: Sequence[int | None]) -> Iterator[Again]:
    for (file, segment), end in zip(started, ends, strict=True):
        start = segment.start if end is None else end
        if segment.end > start:
            yield Again(epoch=segment.epoch, start=start, end=segment.end, session=file.session)


def _gaps(stretches: Sequence[Stretch]) -> Iterator[str]:
    if not stretches:
        yield "rank 0 must have recorded where it started, but the ledger has no start of it"
        return
    for one, following in pairwise(stretches):
        same_epoch = one.epoch == following.epoch
        if same_epoch and one.steps != following.steps:
            yield f"epoch {one.epoch}: it has {one.steps} steps, but {following.steps} from step {following.start} on"
        elif same_epoch and one.end != following.start:
            yield f"epoch {one.epoch}: {steps_text(one.end, following.start)} in no session"
        elif not same_epoch and one.end != one.steps:
            yield f"epoch {one.epoch}: {steps_text(one.end, one.steps)} in no session"
        if not same_epoch and (following.epoch, following.start) != (one.epoch + 1, 0):
            yield f"epoch {following.epoch}: it was begun at step {following.start} after epoch {one.epoch}"
