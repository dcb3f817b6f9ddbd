"""Odometry from depth: each scan is laid over the last keyframes' (point-to-line ICP in the plane)."""

import numpy as np
from scipy.spatial import KDTree

from wsm_data.geometry.planar import compose, points_from_base, relative_to
from wsm_data.planners.depth_scan import DepthScan
from wsm_data.schema.arrays import Float64Array

_ITERATIONS = 12
_NEAR_M = (0.25, 0.1)
"""How near the reference a point must be: in the first half of the iterations, and in the second, m."""

_POINT_SIGMA_M = 0.02
_MOTION_SIGMA = np.array([0.02, 0.003, 0.03])
"""How far a motion may differ from the expected one: along its chord, across it (m), in heading (rad).

A base on two wheels never slips sideways. That is what holds the estimate where the robot turns before a bare wall,
along which scans say nothing.
"""

_KEYFRAMES = 12
_KEYFRAME_M, _KEYFRAME_RAD = 0.25, 0.15
_LEAST_POINTS = 12
_EDGE_M = 0.15


class DepthOdometry:
    """Estimates the pose in the start frame from scans alone: of a base on wheels whose motion changes smoothly."""

    def __init__(self) -> None:
        self._pose = np.zeros(3)
        self._chord_m, self._turn_rad = 0.0, 0.0
        self._keyframes: list[tuple[Float64Array, Float64Array, Float64Array]] = []

    def add(self, scan: DepthScan) -> Float64Array:
        """The pose (x, y, heading) at which a scan was taken; the first is the origin; float64 [3]."""
        points, normals = outline(scan)
        if self._keyframes:
            guess = compose(self._pose, _arc(self._chord_m, self._turn_rad))
            found = self._match(points, guess) if len(points) >= _LEAST_POINTS else guess
            self._chord_m, self._turn_rad = _chord_and_turn(relative_to(found, self._pose))
            self._pose = found
        self._keep(points, normals)
        return self._pose.copy()

    def _match(self, points: Float64Array, guess: Float64Array) -> Float64Array:
        targets = np.concatenate([target for target, _, _ in self._keyframes])
        normals = np.concatenate([normal for _, normal, _ in self._keyframes])
        tree, pose = KDTree(targets), guess.copy()
        prior = _prior(guess[2] - self._turn_rad / 2)
        for iteration in range(_ITERATIONS):
            moved = points_from_base(points, pose)
            near_m = _NEAR_M[iteration * 2 // _ITERATIONS]
            distance, index = tree.query(moved, distance_upper_bound=near_m)
            paired = np.isfinite(distance)
            if paired.sum() < _LEAST_POINTS:
                return guess
            pose = pose + _step(moved[paired], targets[index[paired]], normals[index[paired]], pose, guess, prior)
        return pose

    def _keep(self, points: Float64Array, normals: Float64Array) -> None:
        """Make the scan a keyframe where the robot moved enough."""
        if self._keyframes:
            moved = relative_to(self._pose, self._keyframes[-1][2])
            if np.hypot(moved[0], moved[1]) < _KEYFRAME_M and abs(moved[2]) < _KEYFRAME_RAD:
                return
        heading = np.array([0.0, 0.0, self._pose[2]])
        kept = (points_from_base(points, self._pose), points_from_base(normals, heading), self._pose.copy())
        self._keyframes = [*self._keyframes[-_KEYFRAMES + 1 :], kept]


def _arc(chord_m: float, turn_rad: float) -> Float64Array:
    """The motion of a base on wheels over an arc with this signed chord and turn, in its frame at the start."""
    return np.array([chord_m * np.cos(turn_rad / 2), chord_m * np.sin(turn_rad / 2), turn_rad])


def _chord_and_turn(motion: Float64Array) -> tuple[float, float]:
    """Of the arc that is nearest to a motion; inverse of `_arc`."""
    half = motion[2] / 2
    return float(motion[0] * np.cos(half) + motion[1] * np.sin(half)), float(motion[2])


def _prior(chord_rad: float) -> Float64Array:
    """Information of the expected motion about x, y and heading, for a chord in this direction; float64 [3, 3]."""
    c, s = np.cos(chord_rad), np.sin(chord_rad)
    axes = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(axes @ np.diag(1.0 / _MOTION_SIGMA**2) @ axes.T)


def _step(
    moved: Float64Array,
    targets: Float64Array,
    normals: Float64Array,
    pose: Float64Array,
    guess: Float64Array,
    prior: Float64Array,
) -> Float64Array:
    """One Gauss-Newton step of the distances along the normals, and of the departure from the expected motion."""
    residual = ((moved - targets) * normals).sum(axis=1)
    arm = moved - pose[:2]
    jacobian = np.column_stack([normals, normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]])
    weight = 1.0 / (_POINT_SIGMA_M**2 + residual**2)  # far points count less (Cauchy)
    matrix = jacobian.T @ (jacobian * weight[:, None]) + prior
    return np.asarray(-np.linalg.solve(matrix, jacobian.T @ (weight * residual) + prior @ (pose - guess)))


def outline(scan: DepthScan) -> tuple[Float64Array, Float64Array]:
    """Where the rays end at an obstacle, and the unit normals of the lines through neighbouring ends.

    Rays whose neighbours end elsewhere, at the edges of things, are left out.

    Returns:
        Points and normals in the base frame, float64 [N, 2] each.
    """
    ends = scan.ray_ends_xy_m
    before, after = ends[:-2], ends[2:]
    along = after - before
    length = np.linalg.norm(along, axis=1)
    whole = scan.hit[:-2] & scan.hit[1:-1] & scan.hit[2:] & (length < _EDGE_M) & (length > 0)
    safe = np.where(length > 0, length, 1.0)
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / safe[:, None]
    return ends[1:-1][whole], normals[whole]
