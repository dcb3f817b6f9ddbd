"""`wsm source miniworld`: expert drives through scenes of MiniWorld, recorded as a source of arrays."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer
from tqdm import tqdm

from pipelines.evaluating.nav.config import NavConfig
from pipelines.evaluating.nav.scenes import list_scenes, open_world, scene_episodes
from wsm_data.errors import ConfigError, DataError
from wsm_data.geometry.planar import camera_over
from wsm_data.planners.registry import PlannerConfig, make_planner
from wsm_data.readers.arrays import Frame, write_episode
from wsm_data.sim.config import SimConfig
from wsm_data.sim.environment import Environment
from wsm_data.sim.episodes import Episode
from wsm_data.sim.loop import run_episodes
from wsm_data.sim.result import Rollout
from wsm_data.sim.world import World

CAMERA = "zed"
_EXPERT = "oracle"


@dataclass(frozen=True, kw_only=True)
class RecordRequest:
    """What is recorded.

    Attributes:
        scenes: how many; the kinds take turns.
        episodes: drives in each.
        seed: scenes and drives follow from it.
    """

    scenes: int
    episodes: int
    seed: int


def record_miniworld(out: Path, request: RecordRequest, sim: SimConfig, *, quiet: bool) -> None:
    """Drive the expert through the episodes that `wsm eval nav` has, and write each that arrives.

    Args:
        out: root of the source.
        request: how much.
        sim: robot and camera.
        quiet: no progress bar.

    Raises:
        ConfigError: MiniWorld or OpenGL without a screen is missing, or no drive arrived.
    """
    recorded, total = 0, request.scenes * request.episodes
    config = NavConfig(
        planner=_EXPERT, world="miniworld", seed=request.seed, episodes_per_scene=request.episodes, sim=sim
    )
    with tqdm(total=total, unit="drive", disable=quiet, dynamic_ncols=True) as bar:
        for scene, _ in list_scenes(config, total):
            world = open_world(scene, sim)
            for number, drive in enumerate(scene_episodes(scene, world, config)):
                recorded += _record(out, world, number, drive, sim)
                bar.update()
    if not recorded:
        raise ConfigError(f"no drive arrived of {request.scenes} x {request.episodes}; take another --seed, or more")
    typer.echo(f"{out}: {recorded} of {total} drives arrived and were recorded")
    typer.echo(f"next: wsm run arrays --set source={out} --out RUN")


def _record(out: Path, world: World, number: int, drive: Episode, sim: SimConfig) -> bool:
    """Drive, and write what the camera saw; False where the expert did not arrive."""
    try:
        environment = Environment(world, number, drive, sim)
    except DataError:  # a start that touches something, or a goal behind a wall, is no drive
        return False
    (rollout,) = run_episodes(make_planner(_EXPERT, PlannerConfig(robot=sim.robot)), [environment], sim, 1)
    if not rollout.success:
        return False
    K = sim.intrinsics.matrix
    write_episode(out, world.scene, f"{number:03d}", _seen(world, rollout, sim), K=K, camera=CAMERA, floor_z_m=0.0)
    return True


def _seen(world: World, rollout: Rollout, sim: SimConfig) -> Iterator[Frame]:
    for pose in rollout.poses:
        T_world_camera = camera_over(pose, sim.camera_height_m)
        rgb_u8, depth_m = world.render(T_world_camera)
        yield rgb_u8, depth_m, T_world_camera
