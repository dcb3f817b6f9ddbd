"""The classical stack: enter depth into a map, plan over it, take the unknown for free until it is seen."""

from collections.abc import Callable

import numpy as np

from wsm_data.geometry.planar import points_from_base, points_in_base
from wsm_data.planners.costs import Caution, prices
from wsm_data.planners.depth_odometry import DepthOdometry
from wsm_data.planners.depth_scan import DepthScan, ScanConfig, scan_depth
from wsm_data.planners.local_map import LocalMap
from wsm_data.planners.planner import GoalFrame, Observation, Plan
from wsm_data.planners.route import find_route, free_corridor_m
from wsm_data.planners.steering import Steering
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics

_CAUTION = Caution(margin_m=0.08, comfort_m=0.25)

Localise = Callable[[Observation, DepthScan], Float64Array]
"""Where the robot is in the start frame, from an observation and its scan; float64 [3]."""


class MapAndPlan:
    """Maps and plans in the start frame.

    Args:
        intrinsics: the camera.
        radius_m: radius of the robot, m.
        scan: the camera's mount.
        localise: says where the robot is.
    """

    def __init__(self, intrinsics: Intrinsics, radius_m: float, scan: ScanConfig, localise: Localise):
        self._intrinsics = intrinsics
        self._radius_m = radius_m
        self._scan = scan
        self._localise = localise
        self._map = LocalMap(radius_m)
        self._steering = Steering()

    def plan(self, observation: Observation) -> Plan:
        """Answer to one observation; where the map shows no way, with a turn that shows more of it.

        Raises:
            ValueError: there is no depth.
        """
        if observation.depth_m is None:
            raise ValueError("map-and-plan needs depth")
        scan = scan_depth(observation.depth_m, self._intrinsics, self._scan)
        here = self._localise(observation, scan)
        self._map.add(scan, here)
        goal = _goal_in_start(observation, here)
        grid = self._map.grid(np.stack([here[:2], goal]))
        way = find_route(grid, prices(grid, self._radius_m, _CAUTION, through_unknown=True), here[:2], goal)
        free_m = free_corridor_m(grid, here, self._radius_m)
        in_base = np.array([[0.0, 1.0]]) if way is None else points_in_base(way, here)
        return Plan(
            path_m=self._steering.path(in_base, observation.step, free_m),
            goal_estimate_m=np.append(points_in_base(goal[None], here)[0], 0.0),
            pose_estimate=here,
        )


def _goal_in_start(observation: Observation, here: Float64Array) -> Float64Array:
    """The goal in the frame of the map: as given, or, where it is given anew each time, by where the robot is."""
    if observation.goal_frame is GoalFrame.START:
        return observation.goal_xy_m
    return points_from_base(observation.goal_xy_m[None], here)[0]


def true_pose(observation: Observation, scan: DepthScan) -> Float64Array:  # noqa: ARG001
    """Localise by the pose that the simulator gives.

    Raises:
        ValueError: there is none.
    """
    if observation.pose is None:
        raise ValueError("map-and-plan needs the pose")
    return observation.pose


def estimated_pose() -> Localise:
    """Localise by odometry over the depth scans of one episode, from nothing else."""
    odometry = DepthOdometry()
    return lambda _, scan: odometry.add(scan)
