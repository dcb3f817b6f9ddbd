"""How near the way comes to obstacles."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import CLEARANCE_CAP_M, Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo

TIGHT_M = 0.5


def least_clearance_m(trajectory: Trajectory) -> float:
    """Least distance of a camera position to an occupied square, m; at most 2."""
    return float(trajectory.clearance_m.min())


def tight_share(trajectory: Trajectory) -> float:
    """Share of the way that runs nearer than 0.5 m to an occupied square."""
    return min(1.0, math.fsum(trajectory.weights[trajectory.clearance_m < TIGHT_M]))


LEAST_CLEARANCE = Scorer(
    info=ScorerInfo(
        name="clearance_least_m",
        unit="m",
        direction=Direction.LOWER,
        summary=f"least distance of the path to an obstacle, at most {CLEARANCE_CAP_M:g} m",
    ),
    score=least_clearance_m,
)
TIGHT_SHARE = Scorer(
    info=ScorerInfo(
        name="clearance_tight_share",
        unit="share",
        direction=Direction.HIGHER,
        summary=f"share of the path nearer than {TIGHT_M:g} m to an obstacle",
    ),
    score=tight_share,
)
