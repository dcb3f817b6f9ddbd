"""Does the expert drive where a robot can be?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.verdict import Verdict


def check_expert_path(clearance_m: Float64Array, where: str, min_clearance_m: float) -> Verdict:
    """Refuse a path that leads through or along an obstacle (`path.through_obstacle`).

    Args:
        clearance_m: distance of the way from every camera position to the next to the nearest occupied cell over the
            floor, m, 0 inside one; float64 [T].
        where: what to call the trajectory in the message.
        min_clearance_m: the limit, m.
    """
    nearest = int(np.argmin(clearance_m))
    measured = {"min_clearance_m": float(clearance_m[nearest]), "median_clearance_m": float(np.median(clearance_m))}
    limits = {"min_clearance_m": min_clearance_m}
    close = int(np.count_nonzero(~(clearance_m >= min_clearance_m)))
    if close == 0:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: the expert must keep {min_clearance_m:.2f} m from obstacles, and comes within "
        f"{clearance_m[nearest]:.2f} m at frame {nearest} ({close} frames are too near); do path and map "
        "belong together?"
    )
    details = {**measured, "frame": nearest, "frames": close}
    return Verdict(reason=Reason.PATH_THROUGH_OBSTACLE, message=message, measured=details, limits=limits)
