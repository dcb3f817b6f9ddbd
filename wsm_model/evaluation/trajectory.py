"""What a model's camera trajectory must at least beat."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def zero_motion(true_T3: Float64Array) -> Float64Array:
    """The camera stays where it was: [T, 3] zeros."""
    return np.zeros_like(true_T3)


def constant_velocity(true_T3: Float64Array, frames: int = 4) -> Float64Array:
    """The first `frames` true steps, repeated for ever: [T, 3]. It is told the true speed and heading of the start."""
    known = min(frames, len(true_T3) - 1)
    step = (true_T3[known] - true_T3[0]) / known if known else np.zeros(3)
    return true_T3[0] + np.arange(len(true_T3))[:, None] * step
