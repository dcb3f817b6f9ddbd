"""Means over scenes, and how far they would differ with other scenes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float64Array

_DRAWS = 2000
_COVERAGE = 0.95


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A mean with its interval.

    Attributes:
        value: mean over scenes of the scenes' means.
        low: lower end of the 95 % interval.
        high: upper end of the 95 % interval.
        resampled: what was drawn anew for the interval: `scenes`, or `episodes` where all are of one scene, so that the
            interval says nothing about other scenes.
    """

    value: float
    low: float
    high: float
    resampled: str


def estimate_over_scenes(values: Float64Array, scenes: Sequence[str], seed: int) -> Estimate:
    """Mean of scenes' means, as the start-goal benchmark averages, and a percentile bootstrap (Efron 1979) of it.

    Episodes of a scene are not independent of one another, so scenes are drawn anew, not episodes.

    Args:
        values: one number an episode, finite; float64 [E], E >= 1.
        scenes: the scene of each episode; [E].
        seed: the draws follow from it.

    Raises:
        ValueError: there is no episode, or a value is not finite.
    """
    numbers = np.asarray(values, np.float64)
    if not len(numbers) or len(numbers) != len(scenes) or not np.isfinite(numbers).all():
        raise ValueError(f"values must be finite, one for each of the {len(scenes)} episodes, found {numbers}")
    names, owner = np.unique(np.asarray(scenes), return_inverse=True)
    means = np.bincount(owner, weights=numbers) / np.bincount(owner)
    drawn_from = means if len(names) > 1 else numbers
    rng = np.random.default_rng(seed)
    draws = drawn_from[rng.integers(len(drawn_from), size=(_DRAWS, len(drawn_from)))].mean(axis=1)
    low, high = np.quantile(draws, [(1 - _COVERAGE) / 2, (1 + _COVERAGE) / 2])
    resampled = "scenes" if len(names) > 1 else "episodes"
    return Estimate(value=float(means.mean()), low=float(low), high=float(high), resampled=resampled)
