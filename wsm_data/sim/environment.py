"""One robot in one world: it is moved, it touches things, it is observed."""

import math

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.planar import camera_over, compose, points_in_base, relative_to
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import sample_distance
from wsm_data.planners.planner import GoalFrame, KnownMap, Observation, Plan, Sense
from wsm_data.schema.arrays import Float64Array
from wsm_data.sim.base import CONTROL_STEP_S, drive_arc
from wsm_data.sim.config import SimConfig
from wsm_data.sim.episodes import Episode
from wsm_data.sim.result import Answer, Rollout
from wsm_data.sim.rules import Ending, rules_named
from wsm_data.sim.tracking.controller import TrackingController
from wsm_data.sim.world import World

_CHECK_M = 0.01
"""Contacts are looked for at least this often along an arc, m."""


class Environment:
    """An episode while it runs.

    Args:
        world: where it takes place.
        number: of the episode in its list.
        episode: start and goal.
        config: settings.

    Raises:
        DataError: `start.blocked`: the robot touches something where it starts; `goal.unreachable`: no way of its
            footprint leads from start to goal, or one of them is off the map.
    """

    def __init__(self, world: World, number: int, episode: Episode, config: SimConfig):
        self._world, self._number, self._episode, self._config = world, number, episode, config
        self._rules = rules_named(config.protocol)
        self._geodesic_m = _require_way(world, episode, config)
        self._poses = [episode.start_pose]
        self._clearance_m = [float(world.clearance_m(episode.start_pose[None, :2])[0])]
        self._commands: list[tuple[float, float]] = []
        self._contact: list[bool] = []
        self._reckoned = np.zeros(3)  # the start frame's pose by the commands alone
        self._controller: TrackingController | None = None
        self._answers: list[Answer] = []
        self._believed, self._believed_at = np.zeros(3), np.zeros(3)
        self.ending: Ending | None = None

    @property
    def step(self) -> int:
        """Control steps so far."""
        return len(self._commands)

    def observe(self, senses: frozenset[Sense]) -> Observation:
        """What a planner with these senses is given now; pictures are copies."""
        start, here = self._poses[0], self._poses[-1]
        rgb_u8, depth_m = None, None
        if senses & {Sense.RGB, Sense.DEPTH}:
            rgb_u8, depth_m = self._world.render(camera_over(here, self._config.camera_height_m))
        frame = start if self._config.goal == GoalFrame.START else here
        known = Sense.MAP in senses
        return Observation(
            step=self.step,
            goal_xy_m=points_in_base(self._episode.goal_xy_m[None], frame)[0],
            goal_frame=self._config.goal,
            rgb_u8=rgb_u8.copy() if rgb_u8 is not None and Sense.RGB in senses else None,
            depth_m=depth_m.copy() if depth_m is not None and Sense.DEPTH in senses else None,
            pose=relative_to(here, start) if Sense.POSE in senses else None,
            known_map=KnownMap(grid=self._world.grid, start_pose=start) if known else None,
        )

    def follow(self, plan: Plan, observed_step: int) -> None:
        """Begin to follow the answer to the observation of an earlier step, or of this one.

        Raises:
            ValueError: the controller shall track by estimated poses, and the plan has none.
        """
        observed = self._poses[observed_step]
        self._answers.append(Answer(step=observed_step, pose=observed, plan=plan))
        frame = observed
        if self._config.estimated_controller_pose:
            if plan.pose_estimate is None:
                raise ValueError("a controller on estimated poses needs a planner that gives its pose")
            self._believed, self._believed_at = plan.pose_estimate, self._reckoned_at(observed_step)
            frame = plan.pose_estimate
        path = np.array([compose(frame, np.array([x, y, 0.0]))[:2] for x, y in plan.path_m[:, :2]])
        self._controller = TrackingController(path, self._config.max_speed)

    def advance(self) -> None:
        """Drive for one control step, by the controller or, before the first plan, not at all."""
        speed, turn = (0.0, 0.0) if self._controller is None else self._controller.command(self._controlled_pose())
        before = self._poses[-1]
        after, clearance_m, contact = _move(self._world, before, speed, turn, self._config.robot.radius_m)
        self._reckoned = drive_arc(self._reckoned, speed, turn, CONTROL_STEP_S)
        self._poses.append(after)
        self._commands.append((speed, turn))
        self._clearance_m.append(clearance_m)
        self._contact.append(contact)
        velocity = (after[:2] - before[:2]) / CONTROL_STEP_S if contact else _velocity(speed, after)
        positions = np.array([pose[:2] for pose in self._poses])
        self.ending = self._rules.ending(positions, self._episode.goal_xy_m, velocity)

    def rollout(self) -> Rollout:
        """What happened, once the episode has ended."""
        if self.ending is None:
            raise ValueError("the episode has not ended")
        poses = np.array(self._poses)
        forward = np.diff(poses[:, :2], axis=0)
        middle = (poses[1:, 2] + poses[:-1, 2]) / 2
        return Rollout(
            scene=self._world.scene,
            number=self._number,
            episode=self._episode,
            ending=self.ending,
            success=self._rules.success(self.ending, poses[:, :2], self._episode.goal_xy_m),
            poses=poses,
            commands=np.array(self._commands),
            clearance_m=np.array(self._clearance_m),
            contact=np.array(self._contact),
            driven_m=float((forward[:, 0] * np.cos(middle) + forward[:, 1] * np.sin(middle)).sum()),
            geodesic_m=self._geodesic_m,
            answers=tuple(self._answers),
        )

    def _controlled_pose(self) -> Float64Array:
        if not self._config.estimated_controller_pose:
            return self._poses[-1]
        return compose(self._believed, relative_to(self._reckoned, self._believed_at))

    def _reckoned_at(self, step: int) -> Float64Array:
        pose = np.zeros(3)
        for speed, turn in self._commands[:step]:
            pose = drive_arc(pose, speed, turn, CONTROL_STEP_S)
        return pose


def _velocity(speed: float, pose: Float64Array) -> Float64Array:
    return speed * np.array([math.cos(pose[2]), math.sin(pose[2])])


def _move(
    world: World, pose: Float64Array, speed: float, turn: float, radius_m: float
) -> tuple[Float64Array, float, bool]:
    """Pose, clearance and whether something was touched after one control step.

    The disc goes along its arc up to the last checked place that is free, and turns on there: a round robot always can.
    """
    checks = max(1, math.ceil(speed * CONTROL_STEP_S / _CHECK_M))
    times = CONTROL_STEP_S * np.arange(1, checks + 1) / checks
    places = np.array([drive_arc(pose, speed, turn, float(time)) for time in times])
    clearance = world.clearance_m(places[:, :2])
    blocked = np.flatnonzero(clearance < radius_m)
    if speed == 0.0 or not len(blocked):
        return places[-1], float(clearance[-1]), False
    first = int(blocked[0])
    last = pose if first == 0 else places[first - 1]
    stopped = np.array([last[0], last[1], places[-1, 2]])
    return stopped, float(world.clearance_m(stopped[None, :2])[0]), True


def _require_way(world: World, episode: Episode, config: SimConfig) -> float:
    """Geodesic distance from start to goal, m."""
    where = f"{world.scene}, start {episode.start_pose.tolist()}, goal {episode.goal_xy_m.tolist()}"
    if float(world.clearance_m(episode.start_pose[None, :2])[0]) < config.robot.radius_m:
        raise DataError(Reason.START_BLOCKED, f"the robot must start free of obstacles, and does not: {where}")
    field = geodesic_distance(world.grid, episode.goal_xy_m, config.robot.radius_m, 0.0)
    distance = float(sample_distance(field, world.grid, episode.start_pose[None, :2])[0])
    if not np.isfinite(distance):
        raise DataError(Reason.GOAL_UNREACHABLE, f"a way must lead from start to goal, and none does: {where}")
    return distance
