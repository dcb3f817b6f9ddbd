"""Outputs that nothing needs any more: given up in the ledger, deleted after that, and asked back where one is needed.

What is given up is said before it is deleted: killed in between, a file is left, and no work is lost.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from pipelines.running.folder import locked, read_stage_record
from pipelines.running.ledger import is_whole, ledger_amender, read_ledger
from pipelines.running.stage import Reads, Unit
from pipelines.running.upstream import UpstreamMissing


class OutputsNeeded(UpstreamMissing):
    """A stage must make outputs again that were given up.

    Args:
        message: for a person.
        folder: folder of that stage.
    """

    def __init__(self, message: str, folder: Path):
        super().__init__(message)
        self.folder = folder


@contextmanager
def giving_up(folder: Path) -> Iterator[Callable[[Mapping[str, tuple[str, ...]]], int]]:
    """Hold the folder of a stage; yields a function that gives up outputs by unit, and returns the bytes it freed."""
    with locked(folder), ledger_amender(folder) as amend:
        entries = read_ledger(folder)

        def give_up(outputs: Mapping[str, tuple[str, ...]]) -> int:
            known = {unit: names for unit, names in outputs.items() if unit in entries}
            for unit, names in known.items():
                given_up = tuple(sorted({*entries[unit].given_up, *names}))
                entries[unit] = replace(entries[unit], given_up=given_up)
            amend([entries[unit] for unit in known])
            return sum(_deleted(folder / name) for names in known.values() for name in names)

        yield give_up


@contextmanager
def reclaiming(
    units: Sequence[Unit], reads: Callable[[Sequence[Unit]], Reads], done: Sequence[str]
) -> Iterator[Callable[[str], None]]:
    """Give up what units have read that are done; yields the function that does so for one more.

    Args:
        units: units of the stage that reads.
        reads: what they read.
        done: ids of those that are done.
    """
    by_id = {unit.id: unit for unit in units}
    with ExitStack() as stack:
        give_up = {folder: stack.enter_context(giving_up(folder)) for folder in reads(units)}

        def reclaim(*ids: str) -> None:
            for folder, outputs in reads([by_id[one] for one in ids]).items():
                give_up[folder](outputs)

        reclaim(*done)
        yield reclaim


def present_bytes(folder: Path, outputs: Mapping[str, tuple[str, ...]]) -> int:
    """Bytes of those outputs that are still there."""
    paths = [folder / name for names in outputs.values() for name in names]
    return sum(path.stat().st_size for path in paths if path.is_file())


def require_given_back(reads: Reads) -> None:
    """Have outputs that are needed again be pending in the stages that make them.

    Raises:
        OutputsNeeded: one was given up, and is not there.
    """
    for folder, units in reads.items():
        entries = read_ledger(folder)
        asked = {unit: entries[unit] for unit, names in units.items() if unit in entries}
        back = [
            replace(entry, given_up=tuple(sorted(set(entry.given_up) - set(units[unit]))))
            for unit, entry in asked.items()
            if set(entry.given_up) & set(units[unit])
        ]
        if not back:
            continue
        with locked(folder), ledger_amender(folder) as amend:
            amend(back)
        gone = [entry.outcome.unit for entry in back if not is_whole(folder, entry)]
        if gone:
            record = read_stage_record(folder)
            stage = record.name if record else folder.name
            message = f"{len(gone)} units of {folder} have outputs that were given up and are needed again, such as"
            raise OutputsNeeded(f"{message} {gone[0]}; run `wsm {stage}` again, and this command after it", folder)


def _deleted(path: Path) -> int:
    """Bytes of a file that is deleted; 0 where there is none."""
    try:
        size = path.stat().st_size
        path.unlink()
    except FileNotFoundError:
        return 0
    return size
