"""From camera poses to the floor: a camera looks along z, its base's x, and has its x to the right, its base's -y.

The camera is level, as the benchmark's is: then its origin lies above that of its base.
"""

import numpy as np

from wsm_data.geometry.transform import invert, transform_points
from wsm_data.schema.arrays import Float64Array


def goal_camera0_m(goal_xy_m: Float64Array, T_camera0_camera: Float64Array) -> Float64Array:
    """A goal on the floor in the base frame of a camera, at the height of the camera, in the first camera's frame.

    As in training, where the goal is the last position of the camera.
    """
    x, y = goal_xy_m
    return transform_points(T_camera0_camera, np.array([[-y, 0.0, x]]))[0]


def floor_points(points_camera_m: Float64Array) -> Float64Array:
    """Points [N, 3] of a camera's frame in its base frame; float64 [N, 2], m."""
    return np.stack([points_camera_m[:, 2], -points_camera_m[:, 0]], axis=1)


def floor_pose(T_camera0_camera: Float64Array) -> Float64Array:
    """A camera's pose on the floor in the start frame: x, y (m) and heading (rad); float64 [3]."""
    x, y = floor_points(T_camera0_camera[None, :3, 3])[0]
    along = T_camera0_camera[:3, 2]
    return np.array([x, y, np.arctan2(-along[0], along[2])])


def path_in_base(T_camera0_camera: Float64Array, T_camera0_ahead: Float64Array) -> Float64Array:
    """Positions of camera poses [N, 4, 4] in the base frame of a camera; float64 [N, 2], m."""
    return floor_points(transform_points(invert(T_camera0_camera), T_camera0_ahead[:, :3, 3]))


def followed_path(path_m: Float64Array, turn_rad: float) -> Float64Array:
    """What to answer so that the benchmark's controller gets to the end of a path.

    Args:
        path_m: positions in the base frame [N, 2], the robot's own not among them.
        turn_rad: the greatest bearing of its end that is driven to.

    Returns:
        The path from the robot on, float64 [N + 1, 2], or the turn command: a point to the side, repeated.
    """
    x, y = path_m[-1]
    if abs(np.arctan2(y, x)) > turn_rad:
        return np.tile([0.0, np.copysign(1.0, y)], (len(path_m) + 1, 1))
    return np.concatenate([np.zeros((1, 2)), path_m])
