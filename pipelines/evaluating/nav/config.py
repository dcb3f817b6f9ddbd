"""Settings of `wsm eval nav`, and which of them fix its folder."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from wsm_data.errors import ConfigError
from wsm_data.files.digest import sha256_file
from wsm_data.files.json_values import to_json
from wsm_data.planners.registry import PLANNER_NAMES
from wsm_data.sim.config import SimConfig

if TYPE_CHECKING:  # built-in planners are evaluated without torch
    from wsm_model.agent.config import AgentConfig

AGENT = "agent"
WORLDS = {"homes": "home", "miniworld": "miniworld"}
"""Worlds that are generated, with the first word of their scenes' names; a folder of the same name is not looked at."""
_SAY_THEIR_POSE = ("map-and-plan", "map-and-plan-estimated", AGENT)


@dataclass(frozen=True, kw_only=True)
class NavConfig:
    """One row of a table: a planner in a world under a protocol.

    Attributes:
        planner: name of a built-in planner, `agent`, or the URL of a server of the public protocol.
        model: folder of the agent's model; None for other planners.
        codec_weights: folder of the weights of the model's codec, where it has any.
        world: `homes`, `miniworld`, or a folder with a file of episodes for each scene of these.
        seed: scenes and episodes follow from it. Homes of other seeds than a model was trained on were never seen.
        episodes_per_scene: episodes in each scene.
        sim: robot, protocol, latency.
        agent: settings of the agent; None for other planners.
    """

    planner: str
    model: Path | None = None
    codec_weights: str = ""
    world: str = "homes"
    seed: int = 1000
    episodes_per_scene: int = 5
    sim: SimConfig = field(default_factory=SimConfig)
    agent: "AgentConfig | None" = None

    def __post_init__(self) -> None:
        if not is_url(self.planner) and self.planner not in (*PLANNER_NAMES, AGENT):
            raise ConfigError(
                f"--planner must be one of {', '.join((*PLANNER_NAMES, AGENT))} or a URL, found {self.planner!r}"
            )
        if (self.planner == AGENT) != (self.model is not None):
            raise ConfigError(f"--model belongs to --planner {AGENT}, and must be given there; found {self.model}")
        if self.sim.estimated_controller_pose and self.planner not in _SAY_THEIR_POSE:
            raise ConfigError(
                "--controller-pose estimated needs a planner that says where it believes to be "
                f"({', '.join(_SAY_THEIR_POSE)}), found {self.planner}"
            )


def is_url(planner: str) -> bool:
    """Whether this names a server."""
    return planner.startswith(("http://", "https://"))


def fixed_settings(config: NavConfig) -> dict[str, object]:
    """What all episodes of a folder share: every setting, and the content of the model and of the episodes' files."""
    settings = dict(to_json(config))
    settings["model"] = None if config.model is None else _digest(config.model / "model.json")
    if config.world not in WORLDS:
        settings["world"] = {path.parent.name: _digest(path) for path in episode_files(Path(config.world))}
    return settings


def episode_files(folder: Path) -> list[Path]:
    """Files of episodes of a folder, by the names of its scenes."""
    return sorted(folder.glob("*/pointgoal_start_goal_pairs.npy"))


def _digest(path: Path) -> str:
    if not path.is_file():
        raise ConfigError(f"there must be a file {path}, and is none; is it the right folder?")
    return sha256_file(path)
