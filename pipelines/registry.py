"""All stages, in the order of the flow. Light: a stage's module is loaded when its command runs."""

import importlib
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean

if TYPE_CHECKING:  # it brings numpy, and the command line lists the stages without it
    from pipelines.running.stage import AnyStage


@dataclass(frozen=True, kw_only=True)
class StageEntry:
    """A stage as the command line lists it.

    Attributes:
        name: name of the command, and of the module under pipelines.stages that defines `STAGE`.
        summary: one line of help.
        reads_release: whether it looks at a finished release, which its command then takes as an argument.
    """

    name: str
    summary: str
    reads_release: bool = False


STAGES: tuple[StageEntry, ...] = (
    StageEntry(name="synth", summary="Generate homes and expert trajectories on disk."),
    StageEntry(name="index", summary="Find, check and digest the trajectories of a source."),
    StageEntry(name="split", summary="Deal trajectories or scenes to training and test."),
    StageEntry(name="map", summary="Build the map of every scene."),
    StageEntry(name="encode", summary="Turn trajectories into clips of latents and poses."),
    StageEntry(name="pack", summary="Pack clips into a release of indexed shards."),
    StageEntry(name="verify", summary="Prove that a release is whole, or name the damage.", reads_release=True),
    StageEntry(name="score", summary="Score how hard every clip of a release is.", reads_release=True),
    StageEntry(name="report", summary="Show a release in one HTML file with pictures.", reads_release=True),
    StageEntry(name="select", summary="Choose the hard share of a release, with reasons.", reads_release=True),
)


def load_stage(name: str) -> "AnyStage":
    """The `Stage` of a name.

    Raises:
        ConfigError: there is no such stage.
    """
    stage: AnyStage = load_stage_module(name).STAGE
    return stage


def load_stage_module(name: str) -> ModuleType:
    """The module of a stage.

    Raises:
        ConfigError: there is no such stage.
    """
    names = [entry.name for entry in STAGES]
    if name not in names:
        raise ConfigError(f"there is no stage {name!r}; {did_you_mean(name, names)}")
    return importlib.import_module(f"pipelines.stages.{name}")
