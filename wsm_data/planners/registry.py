"""The built-in planners by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from wsm_data.errors import ConfigError
from wsm_data.planners.depth_scan import ScanConfig
from wsm_data.planners.independent import EpisodePlanner, IndependentPlanner
from wsm_data.planners.map_and_plan import MapAndPlan, estimated_pose, true_pose
from wsm_data.planners.oracle import Oracle
from wsm_data.planners.planner import GoalFrame, Planner, Sense
from wsm_data.planners.reactive import Reactive
from wsm_data.planners.straight_line import StraightLine
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import Robot


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """What built-in planners know of the robot.

    Attributes:
        robot: its footprint.
        scan: its camera's mount.
        goal: the frame of the goals that it will be given.
    """

    robot: Robot = field(default_factory=Robot)
    scan: ScanConfig = field(default_factory=ScanConfig)
    goal: GoalFrame = GoalFrame.START


_Make = Callable[[Intrinsics, PlannerConfig], EpisodePlanner]

_PLANNERS: Mapping[str, tuple[frozenset[Sense], _Make]] = MappingProxyType(
    {
        "oracle": (frozenset({Sense.POSE, Sense.MAP}), lambda _, config: Oracle(config.robot.radius_m)),
        "straight-line": (frozenset(), lambda _, __: StraightLine()),
        "reactive": (
            frozenset({Sense.DEPTH}),
            lambda camera, config: Reactive(camera, config.robot.radius_m, config.scan),
        ),
        "map-and-plan": (
            frozenset({Sense.POSE, Sense.DEPTH}),
            lambda camera, config: MapAndPlan(camera, config.robot.radius_m, config.scan, true_pose),
        ),
        "map-and-plan-estimated": (
            frozenset({Sense.DEPTH}),
            lambda camera, config: MapAndPlan(camera, config.robot.radius_m, config.scan, estimated_pose()),
        ),
    }
)

PLANNER_NAMES = tuple(_PLANNERS)
_PLACES_GOAL_BY_POSE = ("straight-line", "reactive")
"""These use the true pose to know where a goal of the start frame is, and for nothing else."""


def make_planner(name: str, config: PlannerConfig) -> Planner:
    """A built-in planner by its name.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in _PLANNERS:
        raise ConfigError(f"a planner must be one of {', '.join(PLANNER_NAMES)}, found {name!r}")
    senses, make = _PLANNERS[name]
    if name in _PLACES_GOAL_BY_POSE and config.goal is GoalFrame.START:
        senses |= {Sense.POSE}
    return IndependentPlanner(name, senses, lambda intrinsics: make(intrinsics, config))
