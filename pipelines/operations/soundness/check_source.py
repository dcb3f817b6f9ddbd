"""`wsm check`: every check of a run on a source, and nothing written."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from pipelines.operations.soundness.findings import FindingsReport, Telling, tell
from pipelines.operations.soundness.source_manifest import fitting_manifests
from pipelines.recipe import load_recipe, stage_config
from pipelines.running.engines.local import run_local
from pipelines.stages.encode import EncodeConfig
from pipelines.stages.index import IndexConfig
from wsm_data.clips.soundness import CheckedUnit, SourceChecks, check_container
from wsm_data.errors import Reason
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class _Task:
    container: Container
    checks: SourceChecks


@dataclass(frozen=True, kw_only=True)
class _Checked:
    units: tuple[CheckedUnit, ...]


def check_source(source: Path, dataset: str, workers: int, telling: Telling) -> None:
    """Check all of a source and tell what is wrong.

    Args:
        source: its root.
        dataset: the manifest to read it with; empty: the likeliest that fits.
        workers: processes; 0: one a core.
        telling: how.

    Raises:
        BudgetExceeded: something is wrong that was not known.
        ConfigError: no manifest fits, or an option is wrong.
    """
    name = dataset or fitting_manifests(source)[0]
    checks = source_checks(source, name)
    containers = source_reader(checks.dataset).find_containers(source, checks.dataset)
    tasks = [_Task(container=one, checks=checks) for one in containers]
    done: list[CheckedUnit] = []
    with tqdm(total=len(tasks), unit="container", desc="check", disable=telling.quiet, dynamic_ncols=True) as bar:
        for checked in run_local(tasks, _check, workers or os.cpu_count() or 1):
            done += checked.units
            bar.update()
    units = tuple(sorted(done, key=lambda one: (one.unit, one.container)))
    findings = tuple(finding for unit in units for finding in unit.findings) + tuple(_duplicates(units))
    tell(FindingsReport(source=str(source), dataset=name, units=units, findings=findings), telling, "wsm check")


def source_checks(source: Path, dataset: str) -> SourceChecks:
    """The settings of the recipe that is named like the reader of a manifest, so that a run decides the same."""
    manifest = load_dataset(dataset)
    recipe = load_recipe(manifest.reader, None, {"source": str(source), "index": {"dataset": dataset}})
    index, encode = (stage_config(recipe, stage, source) for stage in ("index", "encode"))
    if not isinstance(index, IndexConfig) or not isinstance(encode, EncodeConfig):
        raise TypeError(f"index and encode have settings of their own, found {type(index)} and {type(encode)}")
    return SourceChecks(source=source, dataset=manifest, clip=encode.clip, depth_sample_every=index.depth_sample_every)


def _check(task: _Task) -> Iterator[_Checked]:
    yield _Checked(units=tuple(check_container(task.container, task.checks)))


def _duplicates(units: Sequence[CheckedUnit]) -> Iterator[Refusal]:
    """Trajectories whose name stands in an earlier container, or in the same one, already."""
    first: dict[str, CheckedUnit] = {}
    for unit in units:
        kept = first.setdefault(unit.unit, unit)
        if kept is not unit and unit.digest and kept.digest:
            yield Refusal(
                unit=unit.unit,
                source=unit.container,
                reason=Reason.EPISODE_DUPLICATE,
                message=f"{unit.unit} must be one trajectory, and stands in {kept.container} too: remove one of them, "
                "or rename it",
                details={"kept_in": kept.container, "same_content": unit.digest == kept.digest},
            )
