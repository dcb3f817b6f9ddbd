"""How far around the way leads."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo


def detour_ratio(trajectory: Trajectory) -> float | None:
    """Geodesic distance from the start to the goal over the straight line: 1 where nothing is in the way.

    The stored distance D ends at the goal region, so its radius is added. It is 1 by definition for a start inside that
    region, and never below 1: that would be the rounding of the field. None where D is infinite.
    """
    if not math.isfinite(trajectory.start_distance_m):
        return None
    straight = float(trajectory.goal_distance_m[0])
    if trajectory.start_distance_m <= 0 or straight == 0:
        return 1.0
    return max(1.0, (trajectory.start_distance_m + trajectory.goal_radius_m) / straight)


DETOUR = Scorer(
    info=ScorerInfo(
        name="detour_ratio",
        unit="ratio",
        direction=Direction.HIGHER,
        summary="geodesic over straight-line distance from start to goal",
        version=2,
        absent="no way leads from the start to the goal",
    ),
    score=detour_ratio,
)
