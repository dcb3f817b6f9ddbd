"""Poses on the floor: (x, y, heading), in metres and radians, heading from x towards y."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def points_in_base(points_xy_m: Float64Array, pose: Float64Array) -> Float64Array:
    """Points [N, 2] of the frame that `pose` (x, y, heading) stands in, in the base frame of that pose."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return (points_xy_m - pose[:2]) @ np.array([[c, -s], [s, c]])


def points_from_base(points_xy_m: Float64Array, pose: Float64Array) -> Float64Array:
    """Inverse of `points_in_base`."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return points_xy_m @ np.array([[c, s], [-s, c]]) + pose[:2]


def compose(outer: Float64Array, inner: Float64Array) -> Float64Array:
    """The pose `inner`, which stands in the frame of `outer`, in the frame that `outer` stands in; float64 [3]."""
    position = points_from_base(inner[None, :2], outer)[0]
    return np.array([position[0], position[1], outer[2] + inner[2]])


def relative_to(pose: Float64Array, outer: Float64Array) -> Float64Array:
    """Inverse of `compose`: `pose` in the frame of `outer`, both given in one frame; float64 [3]."""
    position = points_in_base(pose[None, :2], outer)[0]
    return np.array([position[0], position[1], pose[2] - outer[2]])


def camera_over(pose: Float64Array, height_m: float) -> Float64Array:
    """OpenCV camera to world of a level camera that looks along the heading; float64 [4, 4]."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array(
        [[s, 0.0, c, pose[0]], [-c, 0.0, s, pose[1]], [0.0, -1.0, 0.0, height_m], [0.0, 0.0, 0.0, 1.0]],
    )
