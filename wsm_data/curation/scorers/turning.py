"""How much, and how sharply, the camera turns."""

import math

import numpy as np
from numba import njit

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.schema.arrays import Float64Array

SHARP_TURN_M = 0.5


def total_turning_rad(trajectory: Trajectory) -> float:
    """Sum of the absolute changes of heading from frame to frame, rad."""
    return math.fsum(np.abs(np.diff(trajectory.heading_rad)))


def sharpest_turn_rad(trajectory: Trajectory) -> float:
    """Greatest difference of heading between two frames at most 0.5 m of travel apart, rad.

    A stretch of travel, not a moment, is looked at: turning on the spot has no rate per metre, and a rate per frame
    depends on the frame rate.
    """
    travelled = np.concatenate([[0.0], np.cumsum(trajectory.steps_m)])
    return float(_greatest_change(trajectory.heading_rad, travelled, SHARP_TURN_M))


@njit(cache=True)  # type: ignore[untyped-decorator]
def _greatest_change(heading: Float64Array, travelled: Float64Array, window_m: float) -> float:
    greatest = 0.0
    for first in range(len(heading)):
        last = first
        while last < len(heading) and travelled[last] - travelled[first] <= window_m:
            greatest = max(greatest, abs(heading[last] - heading[first]))
            last += 1
    return greatest


TOTAL_TURNING = Scorer(
    info=ScorerInfo(
        name="turning_total_rad",
        unit="rad",
        direction=Direction.HIGHER,
        summary="sum of the absolute changes of heading",
    ),
    score=total_turning_rad,
)
SHARPEST_TURN = Scorer(
    info=ScorerInfo(
        name="turning_sharpest_rad",
        unit="rad per 0.5 m",
        direction=Direction.HIGHER,
        summary="greatest change of heading within 0.5 m of travel",
    ),
    score=sharpest_turn_rad,
)
