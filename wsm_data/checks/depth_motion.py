"""Do poses move when depth images do, all along the way?

Where poses are stuck there is no motion of theirs that could be held against the images. So frames are paired by time,
and all points count that both see, not only those that could tell two motions apart.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from wsm_data.checks.depth_agreement import MIN_POINTS
from wsm_data.checks.depth_pairs import depth_pair, relative_errors
from wsm_data.errors import Reason
from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

MAX_POINTS = 400
"""So many pixels of a frame are compared at most."""

QUANTILE = 0.75
"""A quarter of the points must err by more than the limit: fewer may be what moves, or is hidden from one frame."""

SEEN_THROUGH = 0.875
"""Points behind what the other frame shows may be hidden there, as a room is behind the rails of a chair; points before
it cannot. A motion that is wrong puts some before it on the way there or on the way back: one in eight must be, half of
those that err, since a wrong motion makes no difference between before and behind."""

LIMIT_RATIO = 5.0
"""The limit is so many times that of the median error. On generated homes the quantile is 0.0002 with exact depth; with
a Kinect's noise and poses that jitter by 1 cm and 0.5 degrees it is 0.044 at most in 59 steps, and passed the limit of
0.1 once in 24 trajectories, with 0.13: so one step alone is wrong from twice the limit on."""


def check_depth_motion(
    record: EpisodeRecord, depth_m: Mapping[int, Float32Array], steps: Sequence[tuple[int, int]], max_error: float
) -> Verdict:
    """Refuse poses that stand still, or jump, while the depth images do not (`pose.motion_disagree`).

    Args:
        record: the trajectory.
        depth_m: by frame, depth along the optical axis at the size of the record's intrinsics, m, 0 without
            measurement; float32 [H, W].
        steps: pairs of frames, each of them in `depth_m`.
        max_error: accepted median of |predicted depth / depth there - 1|; see `LIMIT_RATIO`.
    """
    limit = LIMIT_RATIO * max_error
    told = {step: errors for step in steps if (errors := _errors(record, depth_m, step, max_error)) is not None}
    worst = max(told, key=lambda step: told[step][0], default=None)
    measured: dict[str, object] = {"steps": len(told)}
    limits = {"worst_step_error": limit}
    if worst is None:
        return Verdict(measured=measured, limits=limits)
    own, still = told[worst]
    measured |= {"worst_step_error": own, "worst_step": list(worst), "error_without_motion": still}
    wrong = [step for step, (error, _) in told.items() if error > limit and _seen_through(record, depth_m, step, limit)]
    if not wrong or (len(wrong) == 1 and told[wrong[0]][0] <= 2 * limit):
        return Verdict(measured=measured, limits=limits)
    worst = max(wrong, key=lambda step: told[step][0])
    own, still = told[worst]
    measured |= {"worst_step_error": own, "worst_step": list(worst), "error_without_motion": still}
    moved_m = float(np.linalg.norm(np.diff(record.T_world_camera[list(worst), :3, 3], axis=0)))
    advice = (
        "without any motion they would agree: the poses move where the images stand still"
        if still <= limit / LIMIT_RATIO
        else "are the poses stuck, do they jump, or do the images skip?"
    )
    message = (
        f"{record.id.text}: three quarters of the points seen in two frames must lie within {limit:.0%} of where the "
        f"poses put them, found {own:.0%} from frame {worst[0]} to {worst[1]}, between which the poses move "
        f"{moved_m:.2f} m, and {len(wrong)} of {len(told)} steps are wrong; {advice}"
    )
    details = {**measured, "wrong": len(wrong)}
    return Verdict(reason=Reason.POSE_MOTION_DISAGREE, message=message, measured=details, limits=limits)


def _errors(
    record: EpisodeRecord, depth_m: Mapping[int, Float32Array], step: tuple[int, int], max_error: float
) -> tuple[float, float] | None:
    """The quantile of the errors of a step under its poses, and without motion; None where too few points are seen.

    Poses that leave nothing to be seen are infinitely wrong where the images stand still.
    """
    a, b = step
    pair = depth_pair(a, b, depth_m, record.intrinsics, MAX_POINTS)
    T_b_a = invert(record.T_world_camera[b]) @ record.T_world_camera[a]
    own, still = (relative_errors(pair, T, record.intrinsics) for T in (T_b_a, np.eye(4)))
    if np.count_nonzero(np.isfinite(own)) >= MIN_POINTS:
        return _quantile(own), _quantile(still)
    stands = np.count_nonzero(np.isfinite(still)) >= len(still) / 2 and _quantile(still) <= max_error
    return (float("inf"), _quantile(still)) if stands else None


def _seen_through(
    record: EpisodeRecord, depth_m: Mapping[int, Float32Array], step: tuple[int, int], limit: float
) -> bool:
    """Whether the poses put points of either frame before what the other one shows, by more than the limit."""
    shares = []
    for a, b in (step, step[::-1]):
        pair = depth_pair(a, b, depth_m, record.intrinsics, MAX_POINTS)
        T_b_a = invert(record.T_world_camera[b]) @ record.T_world_camera[a]
        errors = relative_errors(pair, T_b_a, record.intrinsics)
        errors = errors[np.isfinite(errors)]
        if len(errors) >= MIN_POINTS:
            shares.append(float(np.quantile(-errors, SEEN_THROUGH)))
    return not shares or max(shares) > limit / (1 + limit)


def _quantile(errors: Float64Array) -> float:
    seen = np.abs(errors[np.isfinite(errors)])
    return float(np.quantile(seen, QUANTILE)) if len(seen) else float("inf")
