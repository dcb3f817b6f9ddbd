"""`wsm synth`: generated homes and trajectories in the layouts of InternData-N1."""

from collections.abc import Iterator, Sequence

from wsm_data.synth.writers import write_scene

from pipelines.config import settings_of
from pipelines.stage import Outcome, Stage, StageContext, Unit
from wsm_data.files.digest import digest_json
from wsm_data.synth.config import SynthConfig

TREE = "tree"
"""Folder of the generated source tree inside the stage's folder."""


def _list_units(config: SynthConfig) -> Sequence[Unit]:
    return [
        Unit(id=f"{camera}/{scene:04d}", inputs={}, payload=(scene, camera))
        for scene in range(config.scenes)
        for camera in config.cameras
    ]


def _process(batch: Sequence[Unit], config: SynthConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        scene, camera = unit.payload
        written = write_scene(context.out / TREE, scene, camera, config)
        outputs = tuple(f"{TREE}/{name}" for name in written)
        facts = {"trajectories": config.trajectories}
        yield Outcome(unit=unit.id, digest=digest_json([unit.id, settings_of(config)]), outputs=outputs, facts=facts)


STAGE = Stage(name="synth", version=1, config_type=SynthConfig, list_units=_list_units, process=_process)
