"""Can the goal be reached on the map from where the expert is?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.verdict import Verdict


def check_goal_reachable(distance_m: Float64Array, where: str) -> Verdict:
    """Refuse a trajectory from which no way leads to its goal on the map (`goal.unreachable`).

    Args:
        distance_m: geodesic distance to the goal region at every camera position, m, not finite where no way leads
            there; float64 [T], the start first.
        where: what to call the trajectory in the message.
    """
    lost = np.flatnonzero(~np.isfinite(distance_m))
    if len(lost) == 0:
        return Verdict(measured={"start_distance_m": float(distance_m[0])})
    message = (
        f"{where}: a way must lead from every position of the expert to the goal, and none does from {len(lost)} of "
        f"{len(distance_m)}, the first is frame {lost[0]}; does the map have a wall where the expert passes?"
    )
    measured = {"frame": int(lost[0]), "frames": len(lost)}
    return Verdict(reason=Reason.GOAL_UNREACHABLE, message=message, measured=measured)
