"""Camera axes, rays and the pinhole projection. Camera frame: x right, y down, z forward (OpenCV)."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics

T_OPENGL_OPENCV: Float64Array = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenCV camera to OpenGL camera (x right, y up, z backward): T_world_opencv = T_world_opengl @ T_OPENGL_OPENCV."""

T_STORED_OPENCV: Mapping[str, Float64Array] = MappingProxyType({"opengl": T_OPENGL_OPENCV, "opencv": np.eye(4)})
"""OpenCV camera to the camera axes a source may store its poses in, by the manifest's `camera_axes`."""


def pixel_rays(intrinsics: Intrinsics) -> Float64Array:
    """Rays through the pixel centres with z = 1, in the camera frame; float64 [H, W, 3]."""
    x = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    y = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    rays = np.ones((intrinsics.height, intrinsics.width, 3))
    rays[..., 0] = x
    rays[..., 1] = y[:, None]
    return rays


def unproject(depth_m: Float64Array, intrinsics: Intrinsics) -> Float64Array:
    """Depth along the optical axis [H, W] (m) to points in the camera frame [H, W, 3] (m)."""
    return pixel_rays(intrinsics) * np.asarray(depth_m, np.float64)[..., None]


def project(points_camera: Float64Array, intrinsics: Intrinsics) -> tuple[Float64Array, Float64Array]:
    """Points [..., 3] (m) of the camera frame to pixels (u, v) [..., 2] and depth [...] (m).

    Where depth <= 0 the point is not in front of the camera, and its pixel means nothing. Pixels may lie outside the
    image: whether they do is for the caller to test.
    """
    z = points_camera[..., 2]
    safe = np.where(z > 0, z, 1.0)
    u = intrinsics.fx * points_camera[..., 0] / safe + intrinsics.cx
    v = intrinsics.fy * points_camera[..., 1] / safe + intrinsics.cy
    return np.stack([u, v], axis=-1), z
