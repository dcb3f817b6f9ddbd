"""Whether the goal can be reached at all."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo


def goal_reachable(trajectory: Trajectory) -> float:
    """1 where the expert's path leads to the goal region over the map, else 0.

    `wsm encode` refuses trajectories without a geodesic way, so 0 speaks of a release that was made otherwise, or of
    a crop that does not hold the way.
    """
    return float(math.isfinite(trajectory.retreat_m.max()))


GOAL_REACHABLE = Scorer(
    info=ScorerInfo(
        name="goal_reachable",
        unit="0 or 1",
        direction=Direction.NEUTRAL,
        summary="1 where the path leads to the goal region on the map",
    ),
    score=goal_reachable,
)
