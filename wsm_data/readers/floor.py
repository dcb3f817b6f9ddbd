"""The floor under a camera that nobody mounted: the lowest horizontal surface that its depth shows."""

from collections.abc import Iterable

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import unproject
from wsm_data.geometry.transform import transform_points
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange

LATTICE_PX = 4
"""Every n-th pixel in both directions is looked at."""

MIN_UPRIGHT = 0.9
"""A surface is horizontal where its normal's z is at least this: within 26 degrees, for depth is noisy."""

MAX_SLOPE_RATIO = 1.1
"""Neighbours on the lattice whose depths differ by more than this ratio lie on two surfaces."""

LAYER_M = 0.04
"""Heights are counted in layers of this thickness; the noise of a depth camera at 3 m is of this size."""

MIN_SHARE = 0.05
"""A layer with this share of all horizontal points is a surface, and the lowest of them the floor."""


def floor_z_m(frames: Iterable[tuple[Float32Array, Float64Array]], intrinsics: Intrinsics, where: str) -> float:
    """Height of the floor in the world, m: the median of the points in its layer and the two beside it.

    Args:
        frames: depth along the optical axis [H, W] (m, 0 without measurement) and camera to world [4, 4] of some frames
            of one scene.
        intrinsics: of the depth images.
        where: what to call the recording in messages.

    Raises:
        DataError: `floor.unseen`: no frame shows a horizontal surface below its camera.
    """
    heights = [_horizontal_z_m(depth_m, T_world_camera, intrinsics) for depth_m, T_world_camera in frames]
    z_m = np.concatenate([np.zeros(0), *heights])
    if not len(z_m):
        raise DataError(
            Reason.FLOOR_UNSEEN,
            f"{where}: a camera without a mount must show the floor in its depth, and no frame shows a horizontal "
            "surface below it; state the floor in the manifest: motion.floor_z_m",
            {"frames": len(heights)},
        )
    layers = np.floor(z_m / LAYER_M).astype(np.int64)
    numbers, counts = np.unique(layers, return_counts=True)
    lowest = numbers[np.flatnonzero(counts >= MIN_SHARE * len(z_m))[0]] if len(numbers) else 0
    return float(np.median(z_m[np.abs(layers - lowest) <= 1]))


def _horizontal_z_m(depth_m: Float32Array, T_world_camera: Float64Array, intrinsics: Intrinsics) -> Float64Array:
    """World heights of the lattice points that lie on a horizontal surface below the camera; float64 [N]."""
    points = unproject(depth_m.astype(np.float64), intrinsics)[::LATTICE_PX, ::LATTICE_PX]
    depth = points[..., 2]
    here, right, below = points[:-1, :-1], points[:-1, 1:], points[1:, :-1]
    nearest = np.minimum(np.minimum(depth[:-1, :-1], depth[:-1, 1:]), depth[1:, :-1])
    farthest = np.maximum(np.maximum(depth[:-1, :-1], depth[:-1, 1:]), depth[1:, :-1])
    whole = (nearest > DepthRange().min_m) & (farthest <= np.minimum(MAX_SLOPE_RATIO * nearest, DepthRange().max_m))
    normals = np.cross(right - here, below - here)[whole]
    lengths = np.linalg.norm(normals, axis=1)
    upright = np.abs(normals @ T_world_camera[2, :3]) >= MIN_UPRIGHT * np.maximum(lengths, np.finfo(float).tiny)
    z_m = transform_points(T_world_camera, here[whole])[:, 2]
    return np.asarray(z_m[upright & (z_m < T_world_camera[2, 3])])
