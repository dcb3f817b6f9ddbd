"""A sample of a source: some of its containers, chosen by a hash, run through the stages of a recipe and measured."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pipelines.artifacts.episode_table import read_episodes
from pipelines.artifacts.layout import release_folder
from pipelines.recipe import Recipe, stage_config
from pipelines.registry import load_stage
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage import AnyStage, Unit
from wsm_data.files.digest import sha256_bytes
from wsm_data.files.folder_bytes import folder_bytes
from wsm_data.view.release.report_data import covered_seconds

LEAST_CONTAINERS = 3
"""Two say how much containers differ, and hardly that."""


@dataclass(frozen=True, kw_only=True)
class SourceSizes:
    """The containers of a source and their sizes.

    Attributes:
        root: root of the source.
        size_bytes: bytes of all files below it.
        units: units of `index`, in their order.
        sizes: bytes of the files of each container, by id; empty where containers have no files of their own.
    """

    root: Path
    size_bytes: int
    units: tuple[Unit, ...]
    sizes: Mapping[str, int]

    def size(self, container: str) -> float:
        """Size of a container: its bytes, or 1 where these are not known."""
        return float(self.sizes.get(container, 1))


@dataclass(frozen=True, kw_only=True)
class MeasuredStage:
    """One stage over the sample.

    Attributes:
        seconds: time on the wall.
        idle_seconds: that part of it in which no unit was worked at: start, listing, end.
        by_container: seconds of work on each container of the sample; empty where units are none of containers.
        unit_seconds: seconds of work on all units.
        folder_bytes: bytes in its folder when all stages have come to their end.
    """

    seconds: float
    idle_seconds: float
    by_container: Mapping[str, float]
    unit_seconds: float
    folder_bytes: int = 0


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What running a sample cost.

    Attributes:
        containers: ids of the containers.
        stages: the stages, in the order of the flow.
        clip_bytes: bytes of the clips of each container; 0 where all of it was refused.
        release_bytes: bytes of the release.
    """

    containers: tuple[str, ...]
    stages: Mapping[str, MeasuredStage]
    clip_bytes: Mapping[str, int]
    release_bytes: int


def source_sizes(recipe: Recipe, run: Path) -> SourceSizes:
    """List the containers of the source of a recipe, as `index` does."""
    config: Any = stage_config(recipe, "index", run)
    units = tuple(load_stage("index").list_units(config))
    found = {unit.id: folder_bytes(config.source / unit.id) for unit in units}
    return SourceSizes(
        root=config.source,
        size_bytes=folder_bytes(config.source),
        units=units,
        sizes=found if all(found.values()) else {},
    )


def draw(source: SourceSizes, share: float) -> list[Unit]:
    """At least that share of a source by size, and three containers: the first by a hash of their names."""
    in_order = sorted(source.units, key=lambda unit: sha256_bytes(unit.id.encode()))
    wanted = share * sum(source.size(unit.id) for unit in source.units)
    chosen: list[Unit] = []
    while len(chosen) < len(in_order) and (len(chosen) < LEAST_CONTAINERS or wanted > 0):
        chosen.append(in_order[len(chosen)])
        wanted -= source.size(chosen[-1].id)
    return chosen


def run_sample(recipe: Recipe, units: Sequence[Unit], run: Path, options: RunOptions) -> Measured:
    """Run the stages of a recipe over some containers of its source.

    Args:
        recipe: the recipe.
        units: units of `index` that are run; the source is listed only once.
        run: an empty folder.
        options: with how many workers and GPUs.

    Raises:
        UpstreamMissing: nothing in these containers can be used.
    """
    stages: dict[str, MeasuredStage] = {}
    container_of = {unit.id: unit.id for unit in units}
    for name in recipe.stages:
        stage: AnyStage = load_stage(name)
        if name == "index":
            stage = replace(stage, list_units=partial(_given, tuple(units)))
        report = run_stage(stage, stage_config(recipe, name, run), run / name, options)
        if name == "index":
            container_of |= {row.id.text: row.container for row in read_episodes(run / name)}
        stages[name] = _measured(run / name, report.seconds, container_of)
    for name, one in stages.items():  # at the end: `score` puts its table into the release
        stages[name] = replace(one, folder_bytes=folder_bytes(run / name))
    clip_bytes = dict.fromkeys((unit.id for unit in units), 0)
    for entry in read_ledger(run / "encode").values():
        clip_bytes[container_of[entry.outcome.unit]] += int(entry.outcome.facts.get("bytes", 0))
    return Measured(
        containers=tuple(unit.id for unit in units),
        stages=stages,
        clip_bytes=clip_bytes,
        release_bytes=folder_bytes(release_folder(run / "pack")),
    )


def _given(units: tuple[Unit, ...], config: object) -> Sequence[Unit]:
    """The listing of `index` for a sample."""
    del config
    return units


def _measured(folder: Path, seconds: float, container_of: Mapping[str, str]) -> MeasuredStage:
    entries = list(read_ledger(folder).values())
    by_container: dict[str, float] = defaultdict(float)
    for one in entries:
        if one.outcome.unit in container_of:
            by_container[container_of[one.outcome.unit]] += one.outcome.seconds
    return MeasuredStage(
        seconds=seconds,
        idle_seconds=max(0.0, seconds - covered_seconds((one.time - one.outcome.seconds, one.time) for one in entries)),
        by_container=by_container,
        unit_seconds=sum(one.outcome.seconds for one in entries),
    )
