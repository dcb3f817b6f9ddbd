"""Drives through the episodes of one scene, and says of each what became of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipelines.evaluating.nav.config import NavConfig
from pipelines.evaluating.nav.planners import open_planner
from pipelines.evaluating.nav.scenes import Scene, open_world, scene_episodes
from wsm_data.errors import ConfigError, DataError
from wsm_data.geometry.planar import camera_over, compose
from wsm_data.planners.planner import Observation
from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.sim.environment import Environment
from wsm_data.sim.episodes import Episode
from wsm_data.sim.loop import run_episodes
from wsm_data.sim.result import EpisodeResult, Rollout
from wsm_data.sim.scoring import score_rollout
from wsm_data.sim.world import World
from wsm_data.view.navigation.film import FilmFrame, write_film
from wsm_data.view.navigation.paths import DrivenPath, draw_paths


@dataclass(frozen=True, kw_only=True)
class SceneTask:
    """What one worker does at a time.

    Attributes:
        config: settings.
        scene: the scene.
        numbers: episodes that are to be driven; none where the map alone is missing.
        before: those of the scene that were driven before.
        picture: where the map with the ways of all goes.
        films: where the films of some of them go, by number.
    """

    config: NavConfig
    scene: Scene
    numbers: tuple[int, ...]
    before: "tuple[Driven, ...]"
    picture: Path
    films: dict[int, Path] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Driven:
    """What became of one episode.

    Attributes:
        scene: name of the scene.
        number: of the episode.
        result: its numbers; None where it was refused.
        reason: code under which it was refused; empty where it was driven.
        message: why it was refused.
        true_m: where the robot was, world; [S, 2], m, to the millimetre.
        goal_m: its goal, likewise.
        senses: what the planner is given beside the goal.
    """

    scene: str
    number: int
    result: EpisodeResult | None = None
    reason: str = ""
    message: str = ""
    true_m: tuple[tuple[float, float], ...] = ()
    goal_m: tuple[float, float] = (0.0, 0.0)
    senses: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Stable name of the episode."""
        return unit_name(self.scene, self.number)


def unit_name(scene: str, number: int) -> str:
    """Stable name of an episode."""
    return f"{scene}-{number:03d}"


def drive_scene(task: SceneTask) -> Iterator[Driven]:
    """Drive through episodes one by one, so that none depends on which others are driven.

    Raises:
        ConfigError: the scene has fewer episodes, or there is no such planner.
    """
    world = open_world(task.scene, task.config.sim)
    episodes = scene_episodes(task.scene, world, task.config)
    driven = list(task.before)
    task.picture.unlink(missing_ok=True)  # who is cut short after the last episode leaves no map that lacks its way
    for number in task.numbers:
        if number >= len(episodes):
            raise ConfigError(
                f"{task.scene.episodes} must hold an episode {number}, it has {len(episodes)}; lower "
                "--episodes-per-scene or --episodes"
            )
        driven.append(_drive(task, world, number, episodes[number]))
        yield driven[-1]
    _draw(task.picture, world, driven)


def _drive(task: SceneTask, world: World, number: int, episode: Episode) -> Driven:
    dreams: dict[int, Uint8Array] = {}

    def watch(_: int, observation: Observation, pictures: Uint8Array) -> None:
        dreams[observation.step] = pictures

    config, film = task.config, task.films.get(number)
    planner = open_planner(config, watch if film else None)
    try:
        environment = Environment(world, number, episode, config.sim)
    except DataError as error:
        return Driven(scene=world.scene, number=number, reason=error.reason, message=error.message)
    (rollout,) = run_episodes(planner, [environment], config.sim, 1)
    if film:
        write_film(film, world.grid, episode.goal_xy_m, _film_frames(world, rollout, dreams, config))
    return Driven(
        scene=world.scene,
        number=number,
        result=score_rollout(rollout, planner.name, config.sim),
        true_m=tuple((round(float(x), 3), round(float(y), 3)) for x, y, _ in rollout.poses),
        goal_m=(float(episode.goal_xy_m[0]), float(episode.goal_xy_m[1])),
        senses=tuple(sorted(planner.senses)),
    )


def _draw(path: Path, world: World, driven: Sequence[Driven]) -> None:
    paths = [
        DrivenPath(true_m=np.array(one.true_m), goal_m=np.array(one.goal_m), success=one.result.success)
        for one in driven
        if one.result is not None
    ]
    draw_paths(path, world.scene, world.grid, paths)


def _film_frames(
    world: World, rollout: Rollout, dreams: dict[int, Uint8Array], config: NavConfig
) -> Iterator[FilmFrame]:
    """One frame a control step; a dream's pictures pass one a control step too."""
    begun = 0
    for step, pose in enumerate(rollout.poses):
        begun = step if step in dreams else begun
        dream = dreams.get(begun)
        distance = float(np.linalg.norm(pose[:2] - rollout.episode.goal_xy_m))
        yield FilmFrame(
            seen_u8=world.render(camera_over(pose, config.sim.camera_height_m))[0],
            beside_u8=None if dream is None else dream[min(step - begun, len(dream) - 1)],
            true_m=rollout.poses[: step + 1, :2],
            estimated_m=_estimates(rollout, step),
            caption=(
                f"{rollout.scene}, episode {rollout.number}",
                f"step {step}, {distance:.2f} m to the goal",
                "red: true, blue: estimated",
            ),
        )


def _estimates(rollout: Rollout, step: int) -> Float64Array:
    """Where the planner believed to be, in the world, until a step; float64 [M, 2]."""
    believed = [
        compose(rollout.poses[0], one.plan.pose_estimate)[:2]
        for one in rollout.answers
        if one.plan.pose_estimate is not None and one.step <= step
    ]
    return np.array(believed).reshape(-1, 2)
