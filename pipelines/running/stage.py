"""What a stage is: a frozen bundle of plain functions that turn inputs into files, unit by unit."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Generic, TypeAlias, TypeVar

from wsm_data.errors import DataError
from wsm_data.schema.verdict import Refusal

ConfigT = TypeVar("ConfigT")

Reads: TypeAlias = Mapping[Path, Mapping[str, tuple[str, ...]]]
"""Outputs that units read: by the folder of the stage that made them, and by its unit."""

DONE, REFUSED = "done", "refused"


@dataclass(frozen=True, kw_only=True)
class Unit:
    """The smallest piece that is done, retried, resumed or refused as a whole.

    Attributes:
        id: stable text from the data, never a position in a listing.
        source: file or folder it comes from, relative to the source root; for quarantine lines.
        inputs: digest of each input's content, by name. With the stage's version and settings it makes the unit's key.
        batch: units with the same non-empty batch are given to one worker together, because they share one sequential
            pass over one archive.
        payload: what `process` needs to find the inputs again; must pickle. Not part of the key.
    """

    id: str
    source: str = ""
    inputs: Mapping[str, str]
    batch: str = ""
    payload: Any = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one unit.

    Attributes:
        unit: id of the unit.
        state: `done` or `refused`.
        digest: digest of what was written: the input digest of the units that follow from it.
        outputs: files written, relative to the stage's folder; a unit is done again when one is gone or has another
            size.
        facts: JSON values worth keeping in the ledger.
        refusals: what was refused: the unit itself, or parts of a unit that is done (episodes of a container).
        seconds: time the unit took; the runner sets it.
        digests: xxh3_128 of each output, in their order, None for a folder; the runner takes them where the unit was
            done. By them a later stage knows what it reads.
    """

    unit: str
    state: str = DONE
    digest: str = ""
    outputs: tuple[str, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    refusals: tuple[Refusal, ...] = ()
    seconds: float = 0.0
    digests: tuple[str | None, ...] = ()

    def __post_init__(self) -> None:
        if self.state not in (DONE, REFUSED):
            raise ValueError(f"state must be {DONE} or {REFUSED}, found {self.state!r}")
        require_inside(self.outputs)


@dataclass(frozen=True, kw_only=True)
class StageContext:
    """What a running stage knows beside its config.

    Attributes:
        out: the stage's own folder.
        server: address of what `Stage.serve` started; empty where nothing was.
    """

    out: Path
    server: str = ""


@dataclass(frozen=True, kw_only=True)
class Settled:
    """The state of a stage after its units, for `finish`.

    Attributes:
        outcomes: outcome of every unit of the listing that has one, by unit id, in the order of the listing.
        pending: ids of units that have none yet (a selection was run, or the run was cut short).
    """

    outcomes: Mapping[str, Outcome]
    pending: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Finished:
    """What `finish` did.

    Attributes:
        refusals: what only the whole can refuse.
        outputs: files written, relative to the stage's folder; the stage is finished again when one is gone or has
            another size.
    """

    refusals: tuple[Refusal, ...] = ()
    outputs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Stage(Generic[ConfigT]):
    """One step of the pipeline.

    Attributes:
        name: name of the command and of the folder in a run.
        version: raised when the bytes written change.
        config_type: keyword-only frozen dataclass of its settings.
        list_units: all units of the inputs, in a stable order.
        process: works on the units of one batch and yields an outcome each; a `DataError` that escapes refuses the
            units that have none yet.
        finish: called once all selected units are settled and something changed since it was last called; writes what
            belongs to no single unit. None where there is nothing.
        parts_fact: numeric fact of an outcome that counts the parts of the unit that were kept, by whose number refused
            parts are judged; empty where a unit is one piece.
        finish_inputs: digest of each input that `finish` alone reads, by name; a changed one has it called again
            although no unit is redone. None where there is none.
        reads: outputs of other stages that nothing but these units ever reads: once they are done, those can be given
            up. None where there are none.
        serve: holds so many GPUs while the workers are there; yields the address at which they ask. It is called where
            there are pending units and GPUs were asked for. None where the stage has no use for one.
        conventions: what decides the outputs and stands in a file that a setting names; a dry run prints it beside the
            settings. None where there is no such file.
    """

    name: str
    version: int
    config_type: type[ConfigT]
    list_units: Callable[[ConfigT], Sequence[Unit]]
    process: Callable[[Sequence[Unit], ConfigT, StageContext], Iterator[Outcome]]
    finish: Callable[[ConfigT, StageContext, Settled], Finished] | None = None
    parts_fact: str = ""
    finish_inputs: Callable[[ConfigT], Mapping[str, str]] | None = None
    reads: Callable[[ConfigT, Sequence[Unit]], Reads] | None = None
    serve: Callable[[ConfigT, int], AbstractContextManager[str]] | None = None
    conventions: Callable[[ConfigT], object] | None = None


AnyStage: TypeAlias = Stage[Any]
"""A stage that is found by its name: its config is built from its `config_type`, and fits."""


def refused(unit: Unit, error: DataError) -> Outcome:
    """Outcome of a unit that cannot be used."""
    return Outcome(unit=unit.id, state=REFUSED, refusals=(Refusal.from_error(unit.id, unit.source, error),))


def require_inside(outputs: Iterable[str]) -> None:
    """Refuse outputs outside the folder of a stage, below which they are looked for, and deleted.

    Raises:
        ValueError: a name leads out of the folder, or is none.
    """
    for output in outputs:
        if output and output[0] not in "/." and ".." not in output:  # of a million, all but a few
            continue
        path = PurePosixPath(output)
        if path.is_absolute() or ".." in path.parts or not path.parts:
            raise ValueError(f"outputs must lie inside the folder, found {output!r}")
