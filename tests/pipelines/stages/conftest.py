"""A source of analytic rooms, and the stages over it, one at a time."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from box_room import MANIFEST_TOML, UPSTAIRS, Drive, Room, along_x, scene_files, write_archive, write_folder

from pipelines.registry import load_stage
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.stage import Outcome, Stage, Unit
from pipelines.running.stage_report import StageReport
from pipelines.stages.encode import EncodeConfig
from pipelines.stages.index import IndexConfig
from pipelines.stages.map import MapConfig
from pipelines.stages.pack import PackConfig
from pipelines.stages.report import ReportConfig
from pipelines.stages.score import ScoreConfig
from pipelines.stages.split import SplitConfig
from pipelines.stages.verify import VerifyConfig
from wsm_data.clips.config import ClipConfig
from wsm_data.files.jsonlines import read_lines
from wsm_data.view.release.clip_survey import SurveyConfig

FLOW = ("index", "split", "map", "encode", "pack", "verify", "report")
DEN = Room(high=(4.0, 2.5, 2.5))
SCENES: Mapping[str, tuple[dict[int, Drive], bool]] = {
    "box_d435i/hall": ({0: along_x(), 1: along_x(y_m=2.4), 2: along_x(room=UPSTAIRS)}, True),
    "box_zed/hall": ({0: along_x(frames=6)}, True),
    "box_d435i/den": ({0: along_x(room=DEN, y_m=1.0)}, False),  # no cloud: its map is fused from depth
}
"""Drives by number, and whether there is a cloud, of each scene."""


@dataclass(frozen=True)
class Pipeline:
    """A source, a run folder, and settings that differ from the tests' own by stage."""

    root: Path
    settings: Mapping[str, Mapping[str, Any]]

    @property
    def source(self) -> Path:
        return self.root / "source"

    @property
    def run_folder(self) -> Path:
        return self.root / "run"

    @property
    def release(self) -> Path:
        return self.folder("pack") / "release"

    def folder(self, stage: str) -> Path:
        return self.run_folder / stage

    def config(self, stage: str, **changes: Any) -> Any:
        """Settings of a stage: those of the tests, of this pipeline, and `changes`."""
        index, split, maps, encode = (self.folder(name) for name in ("index", "split", "map", "encode"))
        survey = SurveyConfig(max_clips=2, thumbnails=1, pictures=1, scenes=1)
        configs = {
            "index": IndexConfig(source=self.source, dataset=str(self.root / "rooms.toml"), depth_sample_every=2),
            "split": SplitConfig(index=index, test_fraction=0.4),
            "map": MapConfig(index=index),
            "encode": EncodeConfig(index=index, map=maps, clip=ClipConfig(width=64, height=32), quality_share=1.0),
            "pack": PackConfig(index=index, split=split, map=maps, encode=encode),
            "verify": VerifyConfig(release=str(self.release)),
            "report": ReportConfig(release=str(self.release), survey=survey),
        }
        return replace(configs[stage], **{**self.settings.get(stage, {}), **changes})

    def run(self, stage: str, *, options: Mapping[str, Any] | None = None, **changes: Any) -> StageReport:
        """Run one stage; no number of refusals is too many."""
        chosen = RunOptions(quiet=True, **{"max_refused": 1000, **(options or {})})
        return run_stage(load_stage(stage), self.config(stage, **changes), self.folder(stage), chosen)

    def run_to(self, last: str) -> dict[str, StageReport]:
        """Run the stages up to one, in their order."""
        return {stage: self.run(stage) for stage in FLOW[: FLOW.index(last) + 1]}

    def units(self, stage: str, **changes: Any) -> dict[str, Unit]:
        """What a stage would work on, by id."""
        loaded: Stage[Any] = load_stage(stage)
        return {unit.id: unit for unit in loaded.list_units(self.config(stage, **changes))}

    def inputs(self, stage: str, **changes: Any) -> dict[str, dict[str, str]]:
        """The inputs of every unit of a stage."""
        return {name: dict(unit.inputs) for name, unit in self.units(stage, **changes).items()}

    def outcomes(self, stage: str) -> dict[str, Outcome]:
        """What became of every unit of a stage."""
        return {name: entry.outcome for name, entry in read_ledger(self.folder(stage)).items()}

    def refusals(self, stage: str) -> list[tuple[str, str]]:
        """Unit and reason of every refusal of a stage."""
        return [
            (str(line["unit"]), str(line["reason"])) for line in read_lines(self.folder(stage) / "quarantine.jsonl")
        ]

    def write(self, scene: str, drives: Mapping[int, Drive], cloud: bool = True) -> Path:
        """Write a scene folder, or an archive where the name ends so."""
        path = self.source / scene
        if scene.endswith(".tar.gz"):
            write_archive(path, scene_files(drives, cloud))
        else:
            write_folder(path, scene_files(drives, cloud))
        return path

    def set_manifest(self, text: str) -> None:
        """Write the manifest of the source's conventions."""
        (self.root / "rooms.toml").write_text(text)


def differing(before: Mapping[str, Mapping[str, str]], after: Mapping[str, Mapping[str, str]]) -> dict[str, set[str]]:
    """Which inputs changed, by unit; a unit that is on one side alone counts as wholly changed."""
    found = {
        unit: {
            name
            for name in {*before.get(unit, {}), *after.get(unit, {})}
            if before.get(unit, {}).get(name) != after.get(unit, {}).get(name)
        }
        for unit in {*before, *after}
    }
    return {unit: names for unit, names in sorted(found.items()) if names}


@pytest.fixture(scope="session")
def changed() -> Callable[..., dict[str, set[str]]]:
    return differing


@pytest.fixture
def make_pipeline(tmp_path: Path) -> Callable[..., Pipeline]:
    """A pipeline over scenes, those of SCENES where none are given; settings by stage."""

    def make(scenes: Mapping[str, tuple[dict[int, Drive], bool]] | None = None, **settings: Any) -> Pipeline:
        return build(tmp_path, scenes, settings)

    return make


def build(
    root: Path, scenes: Mapping[str, tuple[dict[int, Drive], bool]] | None, settings: Mapping[str, Any]
) -> Pipeline:
    pipeline = Pipeline(root, settings)
    pipeline.set_manifest(MANIFEST_TOML)
    for scene, (drives, cloud) in (SCENES if scenes is None else scenes).items():
        pipeline.write(scene, drives, cloud)
    return pipeline


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Pipeline:
    """Every stage over SCENES, done; not to be changed."""
    pipeline = build(tmp_path_factory.mktemp("finished"), None, {})
    pipeline.run_to("report")
    return pipeline


@pytest.fixture
def mapped(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run_to("map")
    return pipeline


@pytest.fixture(scope="session")
def scored(tmp_path_factory: pytest.TempPathFactory, finished: Pipeline) -> Path:
    """A release with its scores; nobody writes into it."""
    folder = tmp_path_factory.mktemp("scored") / "release"
    shutil.copytree(finished.release, folder)
    run_stage(load_stage("score"), ScoreConfig(release=str(folder)), folder.with_name("score"), RunOptions(quiet=True))
    return folder


@pytest.fixture
def release(scored: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(scored, tmp_path / "release"))
