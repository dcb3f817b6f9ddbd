"""Errors of camera trajectories, and what a model must at least beat."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def ate_rmse_m(estimated_T3: Float64Array, true_T3: Float64Array) -> float:
    """Absolute trajectory error: root of the mean squared distance of camera centres, m.

    Both are metric and in the first camera's frame, so nothing is aligned.
    """
    return float(np.sqrt(np.square(estimated_T3 - true_T3).sum(-1).mean()))


def zero_motion(true_T3: Float64Array) -> Float64Array:
    """The camera stays where it was: [T, 3] zeros."""
    return np.zeros_like(true_T3)


def constant_velocity(true_T3: Float64Array, frames: int = 4) -> Float64Array:
    """The first `frames` true steps, repeated for ever: [T, 3]. It is told the true speed and heading of the start."""
    known = min(frames, len(true_T3) - 1)
    step = (true_T3[known] - true_T3[0]) / known if known else np.zeros(3)
    return true_T3[0] + np.arange(len(true_T3))[:, None] * step
