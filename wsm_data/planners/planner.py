"""What a planner is: it sees observations and a goal, and answers with a path. All frames here are the robot's own.

The base frame has its origin on the floor below the camera, x forward, y left. The start frame is the base frame of an
episode's first observation; a pose in it is (x, y, heading), in metres and radians.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np

from wsm_data.geometry.planar import points_in_base
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array, require_array, require_finite
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.occupancy import OccupancyGrid


class Sense(StrEnum):
    """What a planner may be given beside the goal. It is given what it declares, and nothing else."""

    RGB = "rgb"
    DEPTH = "depth"
    POSE = "pose"
    MAP = "map"


class GoalFrame(StrEnum):
    """The frame of the goal: given once in the start frame, or anew in each observation's base frame (an oracle's)."""

    START = "start"
    CURRENT = "current"


@dataclass(frozen=True, kw_only=True)
class KnownMap:
    """The true map of the scene.

    Attributes:
        grid: occupancy in world coordinates for this robot.
        start_pose: the start frame in the world; float64 [3].
    """

    grid: OccupancyGrid
    start_pose: Float64Array


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What one environment shows at one control step.

    Attributes:
        step: control steps since the episode began.
        goal_xy_m: the goal on the floor, m; float64 [2].
        goal_frame: the frame of the goal.
        rgb_u8: picture [H, W, 3], where `Sense.RGB` was declared.
        depth_m: depth along the optical axis, m, 0 where nothing was measured; float32 [H, W], with `Sense.DEPTH`.
        pose: true pose in the start frame; float64 [3], with `Sense.POSE`.
        known_map: the scene, with `Sense.MAP`.
    """

    step: int
    goal_xy_m: Float64Array
    goal_frame: GoalFrame
    rgb_u8: Uint8Array | None = None
    depth_m: Float32Array | None = None
    pose: Float64Array | None = None
    known_map: KnownMap | None = None


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A planner's answer, in the base frame of the observation it answers to.

    Attributes:
        path_m: the path to follow; float64 [T, 2 or 3], T >= 2. A path of zeros is the wish to stand still.
        candidates_m: other paths that were considered; float64 [N, T, 2 or 3].
        values: the planner's own value of each candidate; float64 [N].
        goal_estimate_m: where the planner believes the goal to be; float64 [3].
        pose_estimate: where it believes to be in the start frame; float64 [3].

    Raises:
        ValueError: an array has another shape, or a number is not finite.
    """

    path_m: Float64Array
    candidates_m: Float64Array | None = None
    values: Float64Array | None = None
    goal_estimate_m: Float64Array | None = None
    pose_estimate: Float64Array | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.path_m)
        if len(shape) != 2 or shape[0] < 2 or shape[1] not in (2, 3):
            raise ValueError(f"path_m must be [T, 2 or 3] with T >= 2, found {list(shape)}")
        count = None if self.candidates_m is None else len(self.candidates_m)
        wanted: tuple[tuple[str, tuple[int | None, ...]], ...] = (
            ("path_m", shape),
            ("candidates_m", (None, None, None)),
            ("values", (count,)),
            ("goal_estimate_m", (3,)),
            ("pose_estimate", (3,)),
        )
        for name, expected in wanted:
            array = getattr(self, name)
            if array is not None:
                require_array(name, array, np.float64, expected)
                require_finite(name, array)


class Planner(Protocol):
    """A planner for a number of environments, each with a state of its own.

    Attributes:
        name: as it stands in tables.
        senses: what its observations hold beside the goal.
    """

    @property
    def name(self) -> str:
        """Name in tables."""
        ...

    @property
    def senses(self) -> frozenset[Sense]:
        """What it must be given."""
        ...

    def reset(self, intrinsics: Intrinsics, environments: int) -> None:
        """Forget everything; from now on there are so many environments with this camera."""
        ...

    def reset_environment(self, environment: int) -> None:
        """Forget one environment: a new episode begins there."""
        ...

    def plan(self, observations: Mapping[int, Observation]) -> Mapping[int, Plan | None]:
        """Answer for the environments that show something; None keeps the path that is being followed."""
        ...


def goal_in_base(observation: Observation) -> Float64Array:
    """The goal in the base frame, float64 [2]: as given, or by the true pose where it stands in the start frame.

    Raises:
        ValueError: the goal stands in the start frame and there is no pose.
    """
    if observation.goal_frame == GoalFrame.CURRENT:
        return observation.goal_xy_m
    if observation.pose is None:
        raise ValueError("a goal in the start frame needs the pose; declare Sense.POSE, or estimate it")
    return points_in_base(observation.goal_xy_m[None], observation.pose)[0]
