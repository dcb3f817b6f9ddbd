"""Settings of the closed loop."""

from dataclasses import dataclass, field

from wsm_data.planners.planner import GoalFrame
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import Robot
from wsm_data.synth.config import CAMERAS


@dataclass(frozen=True, kw_only=True)
class SimConfig:
    """The robot and how it is driven; defaults are the start-goal benchmark's.

    Attributes:
        protocol: whose endings and success (`sim.rules`).
        goal: whether the goal is given once, in the start frame, or anew at each observation from the true pose.
        estimated_controller_pose: whether the controller tracks by the planner's own poses, and dead reckoning between
            them, and not by the true ones.
        latency_steps: control steps from an observation to the path that answers it; 0 is synchronous. The benchmark
            sleeps for 0.1 s after each answer, so 1 is the least that it can show.
        max_speed: bound of speed (m/s) and turning rate (rad/s).
        camera_height_m: height of the level camera above the floor, which is the robot's, m.
        intrinsics: the camera.
        robot: the footprint.
        near_miss_m: what comes nearer to the footprint than this is a near miss, m.
    """

    protocol: str = "paper"
    goal: GoalFrame = GoalFrame.START
    estimated_controller_pose: bool = False
    latency_steps: int = 1
    max_speed: float = 0.5
    camera_height_m: float = 0.3
    intrinsics: Intrinsics = field(default_factory=lambda: CAMERAS["zed"])
    robot: Robot = field(default_factory=Robot)
    near_miss_m: float = 0.05

    def __post_init__(self) -> None:
        if self.latency_steps < 0:
            raise ValueError(f"latency_steps must not be negative, found {self.latency_steps}")
        for name in ("max_speed", "camera_height_m"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, found {getattr(self, name)}")
