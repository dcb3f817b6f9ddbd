"""Does the expert end where the source says it drives to?"""

from wsm_data.errors import Reason
from wsm_data.schema.verdict import Verdict

ARRIVED_M = 1e-3
"""The expert's last distance to the goal region must not exceed this, m: distances are stored in steps of 1 mm."""


def check_goal_reached(last_distance_m: float, goal_radius_m: float, where: str) -> Verdict:
    """Refuse a trajectory that does not end in its goal region (`goal.not_reached`).

    Where no goal is stated it is the last position, and this holds of itself.

    Args:
        last_distance_m: geodesic distance of the last camera position to the goal region, m.
        goal_radius_m: radius of that region, m.
        where: what to call the trajectory in the message.
    """
    measured: dict[str, object] = {"last_distance_m": last_distance_m, "goal_radius_m": goal_radius_m}
    limits = {"last_distance_m": ARRIVED_M}
    if last_distance_m <= ARRIVED_M:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{where}: the expert must end within {goal_radius_m:g} m of the stated goal, and ends {last_distance_m:.2f} m "
        "away from that region; state no goal to take the last position, or widen encode.clip.goal_radius_m"
    )
    return Verdict(reason=Reason.GOAL_NOT_REACHED, message=message, measured=measured, limits=limits)
