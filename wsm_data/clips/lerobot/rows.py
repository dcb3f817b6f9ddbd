"""The numbers of a clip as features of a LeRobot data set, one row for each recorded frame."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from wsm_data.geometry.transform import invert, transform_points, transforms_from_vectors, vectors_from_transforms
from wsm_data.schema.clip import Clip

STATE, ACTION, GOAL = "observation.state", "action", "observation.environment_state"
WORLD_POSE, INTRINSICS = "observation.camera_pose", "observation.camera_intrinsics"

_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")

NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        STATE: _POSE,
        ACTION: _POSE,
        GOAL: ("x", "y", "z"),
        WORLD_POSE: tuple(f"m{row}{column}" for row in range(4) for column in range(4)),
        INTRINSICS: ("fx", "fy", "cx", "cy"),
    }
)
"""What each number of a feature is called."""

DTYPES: Mapping[str, str] = MappingProxyType(
    {STATE: "float32", ACTION: "float32", GOAL: "float32", WORLD_POSE: "float64", INTRINSICS: "float64"}
)


def clip_rows(clip: Clip) -> dict[str, np.ndarray]:
    """Features of the N recorded frames of a clip, [N, numbers] each; cameras are OpenCV's, lengths in m.

    - `observation.state`: the camera in the first camera's frame, as the clip stores it;
    - `action`: the next camera in this one's frame, which brings it there; the identity at the last frame;
    - `observation.environment_state`: the goal in this camera's frame;
    - `observation.camera_pose`: camera to world, z up, 4 x 4 by rows;
    - `observation.camera_intrinsics`: fx, fy, cx, cy in px, pixel centres at whole numbers.
    """
    count = clip.meta.recorded_frames
    T_camera0_camera = transforms_from_vectors(clip.poses[:count].astype(np.float64))
    T_world_camera = clip.meta.T_world_camera0_matrix @ T_camera0_camera
    T_camera_next = np.tile(np.eye(4), (count, 1, 1))
    T_camera_next[:-1] = invert(T_camera0_camera[:-1]) @ T_camera0_camera[1:]
    goal_m = transform_points(invert(T_camera0_camera), np.array(clip.meta.goal_camera0_m, np.float64)[None])[:, 0]
    K = clip.intrinsics
    rows = {
        STATE: clip.poses[:count],
        ACTION: vectors_from_transforms(T_camera_next),
        GOAL: goal_m,
        WORLD_POSE: T_world_camera.reshape(count, 16),
        INTRINSICS: np.tile([K.fx, K.fy, K.cx, K.cy], (count, 1)),
    }
    return {name: np.asarray(values, DTYPES[name]) for name, values in rows.items()}
