"""Does the floor lie as far below the camera as its mount says?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.verdict import Verdict

FARTHEST_M = 6.0
"""Rays that would meet the floor beyond this tell nothing: there a small pitch moves it far."""

MIN_POINTS = 500
NEAR = 0.03
"""Floor points have the stated height to this share: a scale off by more, or a mount, is found; twice the limit of the
error of depth on an exact sensor, and more than three deviations of a pose that jitters by 1 cm at 1 m."""

LEAST_SHARE = 0.25
"""Furniture may hide the floor, so that more points lie at another height than at the floor's, but not four times."""

MIN_FOUND = 0.15
"""At the other height so many of all points lie, or there is no floor at all to be seen."""

MAX_BENEATH = 0.1
"""A floor has nothing beneath it, but for noise and a step down: no floor is where more of all points lie lower.
Walls and furniture that fill the view have points at all heights."""

_RATIOS = np.arange(0.3, 1.7 + 1e-9, 0.01)


def check_floor_level(drop_m: Float64Array, height_m: Float64Array, slope: Float64Array, where: str) -> Verdict:
    """Refuse a trajectory whose depth images see the floor at another height (`mount.floor_disagree`).

    Args:
        drop_m: how far below the camera each point of the depth images lies, m; float64 [N].
        height_m: height of the camera over the floor when it saw it, as poses and mount say, m; float64 [N].
        slope: drop for each metre along the ray; float64 [N].
        where: what to call the trajectory in the message.
    """
    tells = (slope > 0) & (height_m < FARTHEST_M * slope) & (height_m > 0)
    count = int(np.count_nonzero(tells))
    measured: dict[str, object] = {"floor_points": count}
    if count < MIN_POINTS:
        return Verdict(measured=measured)
    ratio = np.sort(drop_m[tells] / height_m[tells])
    support = (np.searchsorted(ratio, _RATIOS + NEAR) - np.searchsorted(ratio, _RATIOS - NEAR)) / len(ratio)
    own = float(np.searchsorted(ratio, 1 + NEAR) - np.searchsorted(ratio, 1 - NEAR)) / len(ratio)
    best = int(np.argmax(support))
    beneath = 1 - float(np.searchsorted(ratio, _RATIOS[best] + 2 * NEAR)) / len(ratio)
    measured |= {
        "floor_share": own,
        "best_share": float(support[best]),
        "best_height_ratio": float(_RATIOS[best]),
        "share_beneath": beneath,
    }
    limits = {"floor_share": LEAST_SHARE * float(support[best]), "share_beneath": MAX_BENEATH}
    is_floor = support[best] >= MIN_FOUND and beneath <= MAX_BENEATH
    if not is_floor or own >= LEAST_SHARE * support[best]:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: the floor must lie as far below the camera as its mount says, to {NEAR:.0%}, and {own:.0%} of the "
        f"points do, while {support[best]:.0%} lie at {_RATIOS[best]:.2f} times that height; correct the mount, or the "
        "scale of depth"
    )
    return Verdict(reason=Reason.MOUNT_FLOOR_DISAGREE, message=message, measured=measured, limits=limits)
