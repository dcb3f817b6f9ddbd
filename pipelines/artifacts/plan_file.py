"""plan.json: what `wsm plan` said of a run before it was made, for the report that is made afterwards."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.sealed import sealed, unsealed

PLAN_NAME = "plan.json"


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A forecast number, and the bounds of its interval of 90 %.

    Attributes:
        value: what is expected.
        low: lower bound.
        high: upper bound.
    """

    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0 <= self.low <= self.value <= self.high:
            raise ValueError(f"an estimate must be low <= value <= high, none negative, found {self}")


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run over a source will cost, from a sample of it that was run on this machine.

    Attributes:
        recipe: the recipe.
        source: the source tree.
        workers: worker processes that the run will have.
        measured_workers: worker processes that the sample had.
        gpus: GPUs that encode, in the sample as in the run.
        containers: containers of the source.
        sampled_containers: those of them that were run.
        bytes_in: bytes of the source.
        sampled_bytes: bytes of the sampled containers; 0 where the containers of a source have no files of their own.
        bytes_out: bytes of the release.
        peak_disk_bytes: bytes of the run folder when it is largest: at its end, where nothing is reclaimed.
        hours: time of the whole run, h.
        stage_hours: time of each stage, h.
    """

    recipe: str
    source: str
    workers: int
    measured_workers: int
    gpus: int
    containers: int
    sampled_containers: int
    bytes_in: int
    sampled_bytes: int
    bytes_out: Estimate
    peak_disk_bytes: Estimate
    hours: Estimate
    stage_hours: Mapping[str, Estimate]


def write_plan(run: Path, plan: Plan) -> None:
    """Put a plan into the folder of the run that it speaks of."""
    write_text(run / PLAN_NAME, json.dumps(sealed(to_json(plan)), indent=2, sort_keys=True) + "\n")


def read_plan(run: Path) -> Plan | None:
    """The plan of a run; None where none was made.

    Raises:
        IntegrityError: it was changed since it was written.
    """
    path = run / PLAN_NAME
    if not path.exists():
        return None
    try:
        return from_json(Plan, unsealed(json.loads(path.read_bytes())))
    except ValueError as error:
        raise IntegrityError(f"{path} must hold a plan, but: {error}; run `wsm plan` again") from error
