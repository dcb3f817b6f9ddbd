"""A depth image of a level camera as what stands in the robot's way, seen from above."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from wsm_data.schema.arrays import Float32Array, Float64Array, frozen_array
from wsm_data.schema.camera import Intrinsics

_EVERY_PX = 2


@dataclass(frozen=True, kw_only=True)
class ScanConfig:
    """The camera's mount, and what counts as an obstacle.

    Attributes:
        camera_height_m: height of the level camera above the floor, m.
        ground_clearance_m: what is lower is driven over, m.
        robot_height_m: what is higher is driven under, m.
        range_m: depth beyond this is not used, m.
    """

    camera_height_m: float = 0.3
    ground_clearance_m: float = 0.15
    robot_height_m: float = 0.3
    range_m: float = 5.0


@dataclass(frozen=True, kw_only=True)
class DepthScan:
    """What a depth image says about the floor plan, in the base frame.

    Attributes:
        obstacles_xy_m: all points at the robot's height; float64 [N, 2].
        ray_slopes: y / x of one ray for every second column of the image; float64 [C].
        free_x_m: how far along x each ray is free, at most the range; float64 [C].
        hit: whether an obstacle ends the ray there; bool [C].
    """

    obstacles_xy_m: Float64Array
    ray_slopes: Float64Array
    free_x_m: Float64Array
    hit: np.ndarray

    @property
    def ray_ends_xy_m(self) -> Float64Array:
        """Where each ray stops being free; float64 [C, 2]."""
        return np.column_stack([self.free_x_m, self.free_x_m * self.ray_slopes])

    def __post_init__(self) -> None:
        for name in ("obstacles_xy_m", "ray_slopes", "free_x_m", "hit"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))


def scan_depth(depth_m: Float32Array, intrinsics: Intrinsics, config: ScanConfig) -> DepthScan:
    """Turn a depth image [H, W] (0 where nothing was measured) into a scan.

    Raises:
        ValueError: the image is not of the camera's size.
    """
    if depth_m.shape != (intrinsics.height, intrinsics.width):
        raise ValueError(f"depth must be {intrinsics.height} x {intrinsics.width}, found {depth_m.shape}")
    numbers = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
    heights = np.array([config.camera_height_m, config.ground_clearance_m, config.robot_height_m])
    points, free, hit = _scan(np.ascontiguousarray(depth_m), numbers, heights, config.range_m)
    slopes = -(np.arange(0.0, intrinsics.width, _EVERY_PX, dtype=np.float64) - intrinsics.cx) / intrinsics.fx
    return DepthScan(obstacles_xy_m=points, ray_slopes=slopes, free_x_m=free, hit=hit)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _scan(
    depth_m: Float32Array, camera: Float64Array, heights: Float64Array, range_m: float
) -> tuple[Float64Array, Float64Array, np.ndarray]:
    rows, columns = depth_m.shape
    count = (columns + _EVERY_PX - 1) // _EVERY_PX
    free, hit = np.full(count, range_m), np.zeros(count, np.bool_)
    points = np.empty((count * rows, 2))
    found = 0
    for k in range(count):
        column = k * _EVERY_PX
        slope = -(column - camera[2]) / camera[0]
        seen = False
        for row in range(rows):
            x = depth_m[row, column]
            z = heights[0] - (row - camera[3]) / camera[1] * x
            if x <= 0.0 or z < heights[1] or z > heights[2] + 1e-3:
                continue
            seen = True
            if x > range_m:
                continue
            points[found, 0], points[found, 1] = x, slope * x
            found += 1
            if x < free[k]:
                free[k], hit[k] = x, True
        if not seen:  # nothing was measured at this height: the ray says nothing
            free[k] = 0.0
    return points[:found].copy(), free, hit
