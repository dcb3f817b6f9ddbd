"""A room of 8 x 6 x 3 m with a box in it, whose depth is known in closed form, and a camera that turns in it."""

from collections.abc import Callable

import numpy as np
import pytest

from wsm_data.codecs.depth import normalise_depth
from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange

ROOM = np.array([[-2.0, -2.0, 0.0], [6.0, 4.0, 3.0]])
BOX = np.array([[2.5, 0.8, 0.0], [3.0, 1.6, 0.7]])


def box_depth(T_world_camera: np.ndarray, intrinsics: Intrinsics, box: np.ndarray, inside: bool) -> np.ndarray:
    """Depth along the optical axis to an axis-aligned box, seen from within or from outside (slab method)."""
    rays = pixel_rays(intrinsics) @ T_world_camera[:3, :3].T
    with np.errstate(divide="ignore"):
        a, b = ((corner - T_world_camera[:3, 3]) / rays for corner in box)
    near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
    return far if inside else np.where((near > 0) & (near < far), near, np.inf)


@pytest.fixture(scope="session")
def room_video() -> Callable[..., np.ndarray]:
    """The normalised log-depth video of poses [T, 4, 4] in the room, float32 [T, H, W]; noise is a share of depth."""

    def make(T_world_camera: np.ndarray, intrinsics: Intrinsics, noise: float = 0.0) -> np.ndarray:
        rng = np.random.default_rng(0)
        video = []
        for T in T_world_camera:
            depth = np.minimum(box_depth(T, intrinsics, ROOM, True), box_depth(T, intrinsics, BOX, False))
            depth = np.round(depth * (1 + noise * rng.normal(size=depth.shape)), 4)  # stored in 0.1 mm
            video.append(normalise_depth(depth, DepthRange(max_m=10.0)))
        return np.stack(video)

    return make
