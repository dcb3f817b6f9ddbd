"""Which scenes and episodes are evaluated, and how a scene is opened."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.evaluating.nav.config import WORLDS, NavConfig, episode_files
from wsm_data.errors import ConfigError
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import Robot
from wsm_data.sim.config import SimConfig
from wsm_data.sim.episodes import Episode, make_episodes, read_episodes
from wsm_data.sim.homes import make_home_world
from wsm_data.sim.miniworld.world import make_miniworld
from wsm_data.sim.world import World

_MAKERS: Mapping[str, Callable[[int, int, Robot, float, Intrinsics], World]] = {
    "home": make_home_world,
    "miniworld": make_miniworld,
}
"""Makes scene number n of a seed, by the first word of its name."""
_NAME = re.compile(rf"({'|'.join(_MAKERS)})_([0-9]+)_([0-9]{{4,}})")
_FREE_M = 0.1
"""Generated episodes start and end so far from obstacles, beyond the robot's radius, m."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A scene that is to be opened.

    Attributes:
        kind: first word of its name: which world it is of.
        seed: of the scene.
        index: of the scene.
        episodes: file of its episodes; None where they are generated.
    """

    kind: str
    seed: int
    index: int
    episodes: Path | None = None

    @property
    def name(self) -> str:
        """Name in tables."""
        return f"{self.kind}_{self.seed}_{self.index:04d}"


def list_scenes(config: NavConfig, episodes: int) -> list[tuple[Scene, tuple[int, ...]]]:
    """Scenes with the numbers of their episodes, so many episodes in all; more of them only add to the list.

    A folder's scenes may be fewer than that takes: then there are fewer episodes.

    Raises:
        ConfigError: there is no such world, or its files are not of scenes that can be generated.
    """
    per_scene = config.episodes_per_scene
    counts = [min(per_scene, episodes - start) for start in range(0, episodes, per_scene)]
    if config.world in WORLDS:
        kind = WORLDS[config.world]
        scenes: Sequence[Scene] = [Scene(kind=kind, seed=config.seed, index=index) for index in range(len(counts))]
    else:
        scenes = _scenes_of_folder(Path(config.world))
    return [(scene, tuple(range(count))) for scene, count in zip(scenes, counts, strict=False)]


def open_world(scene: Scene, config: SimConfig) -> World:
    """The world of a scene."""
    make = _MAKERS[scene.kind]
    return make(scene.seed, scene.index, config.robot, config.camera_height_m, config.intrinsics)


def scene_episodes(scene: Scene, world: World, config: NavConfig) -> tuple[Episode, ...]:
    """All episodes of a scene, by their numbers.

    Raises:
        ConfigError: the scene is too small for any.
        IntegrityError: a file does not hold episodes.
    """
    count, robot = config.episodes_per_scene, config.sim.robot
    if scene.episodes is None:
        return make_episodes(world.grid, count, robot.radius_m + _FREE_M, scene.seed + scene.index)
    return read_episodes(scene.episodes)


def _scenes_of_folder(folder: Path) -> list[Scene]:
    files = episode_files(folder) if folder.is_dir() else []
    if not files:
        raise ConfigError(
            f"--world must be {', '.join(WORLDS)}, or a folder of SCENE/pointgoal_start_goal_pairs.npy files, found "
            f"{str(folder)!r}"
        )
    found = []
    for path in files:
        match = _NAME.fullmatch(path.parent.name)
        if match is None:
            names = " or ".join(f"{kind}_SEED_INDEX" for kind in _MAKERS)
            raise ConfigError(
                f"{path}: its folder must be named {names}, after what can be generated, found {path.parent.name!r}"
            )
        found.append(Scene(kind=match[1], seed=int(match[2]), index=int(match[3]), episodes=path))
    return found
