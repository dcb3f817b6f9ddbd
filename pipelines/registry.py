"""All stages, in the order of the flow. Light: a stage's module is loaded when its command runs."""

import importlib
from dataclasses import dataclass
from typing import Any

from wsm_data.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class StageEntry:
    """A stage as the command line lists it.

    Attributes:
        name: name of the command, and of the module under pipelines.stages that defines `STAGE`.
        summary: one line of help.
    """

    name: str
    summary: str


STAGES: tuple[StageEntry, ...] = (
    StageEntry(name="synth", summary="Generate homes and expert trajectories in the layout of InternData-N1."),
    StageEntry(name="index", summary="Find the trajectories of a source, check them, and digest every frame."),
    StageEntry(name="split", summary="Deal trajectories, or whole scenes, to training and test by a hash."),
    StageEntry(name="map", summary="Build the map of every scene from its point cloud or from fused depth."),
    StageEntry(name="encode", summary="Turn trajectories into clips: latents, poses, map crops, geodesic fields."),
    StageEntry(name="pack", summary="Pack clips into a release: shards, index, statistics, manifest last."),
    StageEntry(name="verify", summary="Prove that a release is whole: every byte, every clip, every trajectory."),
    StageEntry(name="report", summary="Write one HTML file with pictures that shows what is in a release."),
)


def load_stage(name: str) -> Any:
    """The `Stage` of a name.

    Raises:
        ConfigError: there is no such stage.
    """
    if name not in {entry.name for entry in STAGES}:
        raise ConfigError(f"there is no stage {name!r}; stages: {', '.join(entry.name for entry in STAGES)}")
    return importlib.import_module(f"pipelines.stages.{name}").STAGE
