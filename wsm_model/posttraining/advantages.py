"""From rewards to optimality probabilities (paper, appendix B.2; DiffusionNFT)."""

from enum import StrEnum

import numpy as np

from wsm_data.schema.arrays import Float64Array

_EPS = 1e-4


class Spread(StrEnum):
    """Over what the standard deviation of rewards is taken: the group, or all rewards of a step (DiffusionNFT)."""

    GROUP = "group"
    STEP = "step"


def advantages(reward: Float64Array, spread: float | None = None) -> Float64Array:
    """(r - mean) / (std + 1e-4) of a group, population standard deviation; float64 [G].

    Args:
        reward: of the group; float64 [G].
        spread: standard deviation to divide by; None: that of the group.
    """
    deviation = float(np.std(reward)) if spread is None else spread
    return (reward - reward.mean()) / (deviation + _EPS)


def optimality(advantage: Float64Array, most: float) -> Float64Array:
    """Rho = 1/2 + 1/2 clip(A / A_max, -1, 1), in [0, 1]."""
    return 0.5 + 0.5 * np.clip(advantage / most, -1.0, 1.0)
