"""Whether the goal can be reached at all."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import sample_distance


def goal_reachable(trajectory: Trajectory) -> float:
    """1 where the start has a geodesic distance, as it is stored and on the map again, else 0.

    The map decides for itself, by the distance field of `wsm encode` (`maps.geodesic`): where the expert drove does not
    count, for a path may lead through a wall. Start and goal may stand beside an obstacle, as they may there. `wsm
    encode` refuses trajectories without a way, so 0 speaks of a release that was made otherwise, or of a crop that does
    not hold the way.
    """
    if not math.isfinite(trajectory.start_distance_m):
        return 0.0
    field_m = geodesic_distance(
        trajectory.map, trajectory.goal_xy_m, trajectory.robot_radius_m, trajectory.goal_radius_m
    )
    return float(math.isfinite(sample_distance(field_m, trajectory.map, trajectory.path_xy_m[:1])[0]))


GOAL_REACHABLE = Scorer(
    info=ScorerInfo(
        name="goal_reachable",
        unit="0 or 1",
        direction=Direction.NEUTRAL,
        summary="1 where a way for the robot leads from the start to the goal region on the map",
        version=2,
    ),
    score=goal_reachable,
)
