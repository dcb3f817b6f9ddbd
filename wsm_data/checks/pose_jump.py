"""Does the camera move, or is it somewhere else all of a sudden?"""

from dataclasses import dataclass

import numpy as np

from wsm_data.errors import Reason
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class PoseJumpConfig:
    """When a step between frames is a jump: it is far above the episode's own steps, and large in itself.

    InternData-N1 stores no time, so that no speed can be asked for; the frames of a planned path lie 3 to
    10 cm and a few degrees apart.

    Attributes:
        step_ratio: a jump is at least so many median steps of its episode.
        step_floor_m: and at least so long, m.
        turn_ratio: likewise for the angle between frames.
        turn_floor_deg: and at least so far, degrees: a tangent may turn sharply where a spline has a corner.
    """

    step_ratio: float = 8.0
    step_floor_m: float = 0.5
    turn_ratio: float = 8.0
    turn_floor_deg: float = 60.0


def check_pose_jump(record: EpisodeRecord, config: PoseJumpConfig | None = None) -> Verdict:
    """Refuse a trajectory with a teleport (`pose.jump`): a wrong pose, or frames that are not there."""
    config = config or PoseJumpConfig()
    T = record.T_world_camera
    if len(T) < 2:
        return Verdict(measured={"max_step_m": 0.0, "max_turn_deg": 0.0})
    step_m = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    turn_deg = np.rad2deg(rotation_angle_rad((invert(T[:-1]) @ T[1:])[:, :3, :3]))
    step_limit_m = max(config.step_floor_m, config.step_ratio * float(np.median(step_m)))
    turn_limit_deg = max(config.turn_floor_deg, config.turn_ratio * float(np.median(turn_deg)))
    measured = {
        "max_step_m": float(step_m.max()),
        "median_step_m": float(np.median(step_m)),
        "step_limit_m": step_limit_m,
        "max_turn_deg": float(turn_deg.max()),
        "turn_limit_deg": turn_limit_deg,
    }
    jumps = np.flatnonzero((step_m > step_limit_m) | (turn_deg > turn_limit_deg))
    if len(jumps) == 0:
        return Verdict(measured=measured)
    at = int(jumps[0])
    message = (
        f"{record.id.text}: between frames a camera may move {step_limit_m:.2f} m and turn {turn_limit_deg:.0f} "
        f"degrees, found {step_m[at]:.2f} m and {turn_deg[at]:.0f} degrees after frame {at} ({len(jumps)} jumps)"
    )
    return Verdict(reason=Reason.POSE_JUMP, message=message, measured={**measured, "frame": at, "jumps": len(jumps)})
