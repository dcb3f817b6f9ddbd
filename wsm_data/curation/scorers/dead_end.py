"""How far one is led astray by driving straight at the goal: dead ends, and walls to be driven around."""

import math

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo

TRAPPED_M = 0.25
"""A retreat up to this is a step around a piece of furniture, or the raster of the map."""


def greatest_retreat_m(trajectory: Trajectory) -> float | None:
    """Greatest distance by which one must move away from the goal, from a position of the path, to reach it at all, m.

    See `maps.retreat`. None where no way leads to the goal region from some position.
    """
    greatest = float(trajectory.retreat_m.max())
    return greatest if math.isfinite(greatest) else None


def trapped_share(trajectory: Trajectory) -> float:
    """Share of the way from which every way to the goal first leads away from it by more than 0.25 m."""
    return min(1.0, math.fsum(trajectory.weights[trajectory.retreat_m > TRAPPED_M]))


GREATEST_RETREAT = Scorer(
    info=ScorerInfo(
        name="dead_end_retreat_m",
        unit="m",
        direction=Direction.HIGHER,
        summary="how far one must move away from the goal to reach it, from the worst position of the path",
        absent="the path does not lead to the goal region on the map",
    ),
    score=greatest_retreat_m,
)
TRAPPED_SHARE = Scorer(
    info=ScorerInfo(
        name="dead_end_share",
        unit="share",
        direction=Direction.HIGHER,
        summary=f"share of the path from which one must move more than {TRAPPED_M:g} m away from the goal to reach it",
    ),
    score=trapped_share,
)
