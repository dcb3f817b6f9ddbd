"""Would depth images fit the cloud better, had the poses or the depth another meaning?

A cloud that fits well enough may still fit better elsewhere. A small turn, another scale or poses of other frames are
held against the cloud as they are; only what is clearly better is named, since noise makes all of them worse alike.
"""

from collections.abc import Callable, Mapping

import numpy as np

from wsm_data.errors import Reason
from wsm_data.geometry.transform import transform_points
from wsm_data.maps.near_surface import near_surface
from wsm_data.maps.scene_map import FloorLevel
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.verdict import Verdict

REACH_M = 0.02
MIN_POINTS = 1000
MAX_POINTS = 4000
BETTER_BY = 0.1
"""The share near the cloud must rise by so much: 12 standard errors of `MAX_POINTS` points, 6 of `MIN_POINTS`."""

SCALES = (0.8, 1 / 1.1, 1 / 1.05, 1.05, 1.1, 1.2)
YAWS_DEG = (-8.0, -5.0, -3.0, 3.0, 5.0, 8.0)
HEIGHTS_M = (-0.2, -0.1, -0.05, 0.05, 0.1, 0.2)
FRAMES = (-5, -3, -2, 2, 3, 5)

Points = Mapping[int, Float64Array]
"""By frame, points in the camera of that frame, m; float64 [N, 3]."""


def check_cloud_alignment(points_m: Points, T_world_camera: Float64Array, level: FloorLevel, where: str) -> Verdict:
    """Refuse a trajectory that fits the cloud clearly better in another meaning (`cloud.misaligned`), which is named.

    Args:
        points_m: points of depth images.
        T_world_camera: poses of all frames; float64 [T, 4, 4].
        level: the surface of the cloud around the floor.
        where: what to call the trajectory in the message.
    """
    count = sum(len(points) for points in points_m.values())
    if count < MIN_POINTS:
        return Verdict(measured={"alignment_points": count})
    points_m = {number: points[:: -(-count // MAX_POINTS)] for number, points in points_m.items()}
    own = _share(level, points_m, lambda number: T_world_camera[number])
    if own + BETTER_BY > 1:  # nothing can be better by that much
        return Verdict(measured={"aligned_share": own}, limits={"best_share": own + BETTER_BY})
    others = {name: _share(level, points_m, placed) for name, placed in _placements(T_world_camera).items()} | {
        f"depth were {scale:.2f} times as large": _share(
            level,
            {number: scale * points for number, points in points_m.items()},
            lambda number: T_world_camera[number],
        )
        for scale in SCALES
    }
    best = max(others, key=lambda name: others[name])
    measured = {"aligned_share": own, "best_share": others[best], "best": best}
    limits = {"best_share": own + BETTER_BY}
    if others[best] < own + BETTER_BY:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: {own:.0%} of the points that depth images show lie within {REACH_M:g} m of the cloud, and "
        f"{others[best]:.0%} would if {best}; correct the poses, the mount or the depth"
    )
    return Verdict(reason=Reason.CLOUD_MISALIGNED, message=message, measured=measured, limits=limits)


def _placements(T_world_camera: Float64Array) -> dict[str, Callable[[int], Float64Array]]:
    last = len(T_world_camera) - 1

    def turned(yaw_deg: float) -> Callable[[int], Float64Array]:
        return lambda number: _turned(T_world_camera[number], yaw_deg)

    def lifted(by_m: float) -> Callable[[int], Float64Array]:
        return lambda number: T_world_camera[number] + by_m * _UP

    def later(frames: int) -> Callable[[int], Float64Array]:
        return lambda number: T_world_camera[min(max(number + frames, 0), last)]

    return (
        {f"cameras were turned by {yaw:+g} degrees of yaw": turned(yaw) for yaw in YAWS_DEG}
        | {f"cameras were {by:+g} m higher": lifted(by) for by in HEIGHTS_M}
        | {f"poses were those of {frames:+d} frames": later(frames) for frames in FRAMES if abs(frames) <= last}
    )


_UP = np.zeros((4, 4))
_UP[2, 3] = 1.0


def _turned(T_world_camera: Float64Array, yaw_deg: float) -> Float64Array:
    """The camera turned about its own place and the vertical."""
    c, s = np.cos(np.deg2rad(yaw_deg)), np.sin(np.deg2rad(yaw_deg))
    turned: Float64Array = T_world_camera.copy()
    turned[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ T_world_camera[:3, :3]
    return turned


def _share(level: FloorLevel, points_m: Points, placed: Callable[[int], Float64Array]) -> float:
    world_m = [transform_points(placed(number), points) for number, points in points_m.items()]
    return float(np.mean(near_surface(level, np.concatenate(world_m), REACH_M)))
