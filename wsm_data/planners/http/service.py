"""What a planner answers to the requests of the public protocol, without sockets: a state for each environment."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsm_data.errors import ConfigError, WsmError
from wsm_data.geometry.planar import points_in_base
from wsm_data.planners.http.answer import encode_answer
from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.wire import FARTHEST_CODE, decode_depth_m, decode_goals, decode_image, read_numbers
from wsm_data.planners.planner import GoalFrame, Observation, Plan, Planner, Sense
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.camera import Intrinsics

_MOST_ENVIRONMENTS = 256
_FARTHEST_M = np.float32(FARTHEST_CODE / 10000)

GOAL_FRAMES = {GoalClient.START_GOAL: GoalFrame.START, GoalClient.POINT_GOAL: GoalFrame.CURRENT}
"""The frame of each client's goals."""


@dataclass(kw_only=True)
class _Environment:
    """What is remembered of one environment since its last reset."""

    step: int = 0
    last: Plan | None = None


class PlannerService:
    """Answers requests, one at a time.

    The camera's size is known from the first pictures after a reset, so the planner is reset with them.

    Args:
        planner: the planner.
        client: whose requests these are.
    """

    def __init__(self, planner: Planner, client: GoalClient):
        self.planner = planner
        self.client = client
        self._matrix: Float64Array | None = None
        self._intrinsics: Intrinsics | None = None
        self._environments: list[_Environment] = []

    @property
    def environments(self) -> int:
        """How many there are since the last reset."""
        return len(self._environments)

    def reset(self, record: Mapping[str, Any]) -> bytes:
        """Answer to /navigator_reset: `intrinsic` and `batch_size`; what else is sent is not needed.

        Raises:
            WireError: `malformed`.
        """
        matrix = read_numbers(record, "intrinsic", (3, 3))
        batch = _whole_number(record, "batch_size")
        if not 1 <= batch <= _MOST_ENVIRONMENTS:
            raise WireError(Fault.MALFORMED, f"batch_size must be 1 to {_MOST_ENVIRONMENTS}, found {batch}")
        self._matrix, self._intrinsics = matrix, None
        self._environments = [_Environment() for _ in range(batch)]
        return self._name()

    def reset_environment(self, record: Mapping[str, Any]) -> bytes:
        """Answer to /navigator_reset_env: `env_id`.

        Raises:
            WireError: `malformed`, `out_of_turn`, or `wrong_batch` where there is no such environment.
        """
        self._require_reset()
        number = _whole_number(record, "env_id")
        if not 0 <= number < self.environments:
            raise WireError(Fault.WRONG_BATCH, f"env_id must be below {self.environments}, found {number}")
        self._environments[number] = _Environment()
        if self._intrinsics is not None:
            self.planner.reset_environment(number)
        return self._name()

    def point_goal_step(self, form: Mapping[str, bytes]) -> bytes:
        """Answer to /pointgoal_step: `image`, `depth` and `goal_data`.

        Raises:
            WireError: any but those of a network; the state of every environment is then as it was before, unless the
                planner itself failed.
        """
        self._require_reset()
        missing = [name for name in ("image", "depth", "goal_data") if name not in form]
        if missing:
            raise WireError(Fault.MALFORMED, f"the form must hold image, depth and goal_data; missing: {missing}")
        goals = decode_goals(form["goal_data"], self.environments)
        rgb = decode_image(form["image"], self.environments)
        depth = _measured(decode_depth_m(form["depth"], self.environments))
        if depth.shape != rgb.shape[:3]:
            raise WireError(
                Fault.WRONG_BATCH, f"depth must be of the picture's size {rgb.shape[:3]}, found {depth.shape}"
            )
        observations = {
            number: Observation(
                step=self._environments[number].step,
                goal_xy_m=goals[number],
                goal_frame=GOAL_FRAMES[self.client],
                rgb_u8=rgb[number] if Sense.RGB in self.planner.senses else None,
                depth_m=depth[number] if Sense.DEPTH in self.planner.senses else None,
            )
            for number in range(self.environments)
        }
        return self._answer(observations, height=rgb.shape[1], width=rgb.shape[2])

    def _answer(self, observations: Mapping[int, Observation], *, height: int, width: int) -> bytes:
        try:
            self._look_through(height, width)
            plans = self.planner.plan(observations)
        except (ValueError, WsmError) as error:
            raise WireError(Fault.PLANNER, f"the planner {self.planner.name} cannot answer: {error}") from error
        for number, plan in plans.items():
            environment = self._environments[number]
            environment.step += 1
            environment.last = plan or environment.last
        if all(plan is None for plan in plans.values()):
            return b'{"keep": true}'
        current = [one.last or Plan(path_m=np.zeros((2, 3))) for one in self._environments]
        return encode_answer(current, self._goal_estimates(observations, current))

    def _look_through(self, height: int, width: int) -> None:
        """Reset the planner for pictures of this size; they must stay of it.

        Raises:
            WireError: `wrong_batch`: pictures of another size than the first after the reset.
            ValueError: the camera matrix does not fit them.
        """
        if self._intrinsics is None and self._matrix is not None:
            (fx, _, cx), (_, fy, cy) = self._matrix[:2].tolist()
            intrinsics = Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=width, height=height)
            self.planner.reset(intrinsics, self.environments)
            self._intrinsics = intrinsics
        found = self._intrinsics
        if found is not None and (found.height, found.width) != (height, width):
            raise WireError(
                Fault.WRONG_BATCH,
                f"pictures must stay {found.width} x {found.height} until the next reset, found {width} x {height}",
            )

    def _goal_estimates(self, observations: Mapping[int, Observation], plans: list[Plan]) -> Float64Array | None:
        if self.client is GoalClient.POINT_GOAL:
            return None
        return np.stack([_goal_estimate(observations[number], plan) for number, plan in enumerate(plans)])

    def _require_reset(self) -> None:
        if self._matrix is None:
            raise WireError(Fault.OUT_OF_TURN, "/navigator_reset must come first: it says how many environments are")

    def _name(self) -> bytes:
        return json.dumps({"algo": self.planner.name}).encode()


def require_servable(planner: Planner) -> None:
    """Check that a planner can do with what the protocol brings: pictures, depth and goals.

    Raises:
        ConfigError: it needs the map, or its true pose.
    """
    if Sense.MAP in planner.senses:
        raise ConfigError(
            f"{planner.name} needs the map of the scene, which the protocol does not bring; serve another planner"
        )
    if Sense.POSE in planner.senses:
        raise ConfigError(
            f"{planner.name} needs its true pose, which the protocol does not bring; serve a planner that estimates "
            f"it, or, to {GoalClient.POINT_GOAL} clients, one that needs it for goals of the start frame alone"
        )


def _goal_estimate(observation: Observation, plan: Plan) -> Float64Array:
    """Where a planner believes a goal of the start frame to be: as it says, or by the pose it believes in."""
    if plan.goal_estimate_m is not None:
        return plan.goal_estimate_m
    pose = np.zeros(3) if plan.pose_estimate is None else plan.pose_estimate
    return np.append(points_in_base(observation.goal_xy_m[None], pose)[0], 0.0)


def _measured(depth_m: Float32Array) -> Float32Array:
    """The farthest code means nothing hit as well as a wall: it measures nothing, which is 0 in an observation."""
    return np.where(depth_m >= _FARTHEST_M, np.float32(0), depth_m)


def _whole_number(record: Mapping[str, Any], name: str) -> int:
    number = record.get(name)
    if not isinstance(number, int) or isinstance(number, bool):
        raise WireError(Fault.MALFORMED, f"{name} must be a whole number, found {number!r}")
    return number
