"""Which frames of a recording become trajectories: those between which the camera moved, in pieces of a length."""

from itertools import pairwise

import numpy as np

from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.arrays import Float64Array, Int64Array
from wsm_data.schema.source.motion import Motion


def moving_frames(T_world_camera: Float64Array, motion: Motion) -> Int64Array:
    """Indices of the frames that are kept, rising: the first, and each that moved or turned far enough from the last.

    Args:
        T_world_camera: poses of a recording, float64 [N, 4, 4].
        motion: `min_step_m` and `min_turn_deg`; where both are 0 every frame is kept.
    """
    if not (motion.min_step_m or motion.min_turn_deg):
        return np.arange(len(T_world_camera))
    kept = [0] if len(T_world_camera) else []
    for index in range(1, len(T_world_camera)):
        T_last_this = invert(T_world_camera[kept[-1]]) @ T_world_camera[index]
        moved_m = float(np.linalg.norm(T_last_this[:3, 3]))
        turned_deg = float(np.rad2deg(rotation_angle_rad(T_last_this[:3, :3])))
        far = 0 < motion.min_step_m <= moved_m or 0 < motion.min_turn_deg <= turned_deg
        if far:
            kept.append(index)
    return np.array(kept, np.int64)


def pieces(frames: int, max_frames: int) -> list[slice]:
    """A recording of so many frames in as few pieces as `max_frames` allows, of lengths that differ by one at most.

    One piece where `max_frames` is 0.
    """
    count = max(1, -(-frames // max_frames)) if max_frames else 1
    bounds = np.linspace(0, frames, count + 1).round().astype(int).tolist()
    return [slice(low, high) for low, high in pairwise(bounds)]
