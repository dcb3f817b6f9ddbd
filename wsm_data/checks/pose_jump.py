"""Does the camera move, or is it somewhere else all of a sudden?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.source.check_limits import CheckLimits
from wsm_data.schema.verdict import Verdict

STEP_RATIO = 8.0
"""A jump is at least so many median steps of its episode, or so many median turns. InternData-N1 stores no time, so
that no speed can be asked for; the frames of a planned path lie 3 to 10 cm and a few degrees apart."""


def check_pose_jump(record: EpisodeRecord, limits: CheckLimits) -> Verdict:
    """Refuse a trajectory with a teleport (`pose.jump`): a wrong pose, or frames that are not there.

    A jump is far above the episode's own steps, and large in itself.
    """
    T = record.T_world_camera
    if len(T) < 2:
        return Verdict(measured={"max_step_m": 0.0, "max_turn_deg": 0.0})
    step_m = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    turn_deg = np.rad2deg(rotation_angle_rad((invert(T[:-1]) @ T[1:])[:, :3, :3]))
    step_limit_m = max(limits.min_jump_m, STEP_RATIO * float(np.median(step_m)))
    turn_limit_deg = max(limits.min_jump_deg, STEP_RATIO * float(np.median(turn_deg)))
    measured = {
        "max_step_m": float(step_m.max()),
        "median_step_m": float(np.median(step_m)),
        "max_turn_deg": float(turn_deg.max()),
    }
    allowed = {"max_step_m": step_limit_m, "max_turn_deg": turn_limit_deg}
    jumps = np.flatnonzero((step_m > step_limit_m) | (turn_deg > turn_limit_deg))
    if len(jumps) == 0:
        return Verdict(measured=measured, limits=allowed)
    at = int(jumps[0])
    message = (
        f"{record.id.text}: between frames a camera may move {step_limit_m:.2f} m and turn {turn_limit_deg:.0f} "
        f"degrees, found {step_m[at]:.2f} m and {turn_deg[at]:.0f} degrees after frame {at} ({len(jumps)} jumps)"
    )
    details = {**measured, "frame": at, "jumps": len(jumps)}
    return Verdict(reason=Reason.POSE_JUMP, message=message, measured=details, limits=allowed)
