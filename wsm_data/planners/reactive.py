"""A planner without memory: of the directions it sees, the free one that comes nearest to the goal."""

import math

import numpy as np

from wsm_data.planners.depth_scan import ScanConfig, scan_depth
from wsm_data.planners.planner import Observation, Plan, goal_in_base
from wsm_data.planners.steering import Steering
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics

_CANDIDATES = 41
_HORIZON_M, _LEAST_M = 2.5, 0.4
_MARGIN_M = 0.06
_POINTS = 24


class Reactive:
    """Looks at one depth image at a time.

    Args:
        intrinsics: the camera.
        radius_m: radius of the robot, m.
        scan: the camera's mount.
    """

    def __init__(self, intrinsics: Intrinsics, radius_m: float, scan: ScanConfig):
        self._intrinsics = intrinsics
        self._half_width_m = radius_m + _MARGIN_M
        self._scan = scan
        self._steering = Steering()
        half_view = math.atan(min(intrinsics.cx, intrinsics.width - 1 - intrinsics.cx) / intrinsics.fx)
        self._bearings = np.linspace(-half_view, half_view, _CANDIDATES)

    def plan(self, observation: Observation) -> Plan:
        """Answer to one observation; where no direction is free, with a turn to the side of the goal."""
        if observation.depth_m is None:
            raise ValueError("the reactive planner needs depth")
        goal = goal_in_base(observation)
        scan = scan_depth(observation.depth_m, self._intrinsics, self._scan)
        points = scan.ray_ends_xy_m[scan.hit]
        free = free_lengths(points, self._bearings, self._half_width_m, _HORIZON_M)
        distance, bearing = float(np.linalg.norm(goal)), math.atan2(goal[1], goal[0])
        ahead_m = float(free[_CANDIDATES // 2])
        lengths = np.minimum(np.maximum(free - _MARGIN_M, 0.0), distance)
        ends = lengths[:, None] * np.column_stack([np.cos(self._bearings), np.sin(self._bearings)])
        cost = np.linalg.norm(ends - goal, axis=1)
        best = int(np.argmin(cost))
        sees_goal = abs(bearing) <= self._bearings[-1]
        if sees_goal and lengths[best] < min(_LEAST_M, distance):
            way = np.array([[0.0, math.copysign(1.0, bearing)]])
        else:
            way = ends[best : best + 1] if sees_goal else goal[None]
        share = np.linspace(1 / _POINTS, 1.0, _POINTS)[None, :, None]
        return Plan(
            path_m=self._steering.path(way, observation.step, ahead_m),
            candidates_m=ends[:, None] * share,
            values=-cost,
        )


def free_lengths(
    points_xy_m: Float64Array, bearings_rad: Float64Array, half_width_m: float, most_m: float
) -> Float64Array:
    """How far a robot can drive straight along each bearing until a point comes within its half width.

    Args:
        points_xy_m: obstacles in the base frame, m; [N, 2].
        bearings_rad: directions, to the left of ahead; [B].
        half_width_m: half the width of what is driven through, m.
        most_m: the length that is given where nothing stands in the way, m.

    Returns:
        float64 [B], m.
    """
    directions = np.column_stack([np.cos(bearings_rad), np.sin(bearings_rad)])
    along = directions @ points_xy_m.T
    across = np.abs(np.column_stack([-directions[:, 1], directions[:, 0]]) @ points_xy_m.T)
    depth = np.sqrt(np.maximum(half_width_m**2 - across**2, 0.0))
    free = np.where((across < half_width_m) & (along > 0), along - depth, most_m)
    return np.clip(free.min(axis=1, initial=most_m), 0.0, most_m)
