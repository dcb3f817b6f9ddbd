"""How long the way is."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo


def path_length_m(trajectory: Trajectory) -> float:
    """Length of the expert's way over the floor, m."""
    return math.fsum(trajectory.steps_m)


PATH_LENGTH = Scorer(
    info=ScorerInfo(
        name="path_length_m", unit="m", direction=Direction.HIGHER, summary="length of the expert's way over the floor"
    ),
    score=path_length_m,
)
