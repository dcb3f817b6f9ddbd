"""`wsm synth`: generated homes and trajectories in the layouts of InternData-N1, and a 3D model of each home."""

from collections.abc import Iterator, Sequence

from pipelines.running.settings import settings_of
from pipelines.running.stage import Outcome, Stage, StageContext, Unit
from wsm_data.files.digest import digest_json
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.recording import plan_recording
from wsm_data.synth.writers.scenes import write_home, write_recording

TREE = "tree"
"""Folder of the generated source tree inside the stage's folder."""

HOMES = "homes"
"""Folder beside it with a 3D model of every home; no part of the source."""


def _list_units(config: SynthConfig) -> Sequence[Unit]:
    return [
        Unit(id=f"{camera}/{scene:04d}", inputs={}, payload=(scene, camera))
        for scene in range(config.scenes)
        for camera in config.cameras
    ]


def _process(batch: Sequence[Unit], config: SynthConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        scene, camera = unit.payload
        recording = plan_recording(scene, camera, config)
        outputs = [f"{TREE}/{name}" for name in write_recording(context.out / TREE, recording, config)]
        if camera == config.cameras[0]:  # all cameras record the same home
            outputs.append(f"{HOMES}/{write_home(context.out / HOMES, recording, config)}")
        facts = {"trajectories": config.trajectories}
        yield Outcome(
            unit=unit.id, digest=digest_json([unit.id, settings_of(config)]), outputs=tuple(outputs), facts=facts
        )


STAGE = Stage(name="synth", version=2, config_type=SynthConfig, list_units=_list_units, process=_process)
