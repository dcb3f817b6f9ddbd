"""What a sample says of the whole: totals with their uncertainty, and how long work takes on so many workers."""

import heapq
from collections.abc import Iterable, Sequence
from math import sqrt

import numpy as np
from scipy.stats import t

from pipelines.artifacts.plan_file import Estimate

_COVERED = 0.9


def total_of(values: Sequence[float], sizes: Sequence[float], containers: int, total_size: float) -> Estimate:
    """Total over all containers of what was measured on some of them, with an interval of 90 %.

    The ratio estimator of sampling without replacement (Cochran, Sampling Techniques, 3rd ed., equations 6.1 and
    6.9): what is measured grows with the size of a container. Nothing is left to chance once all were measured.

    Args:
        values: what was measured on each container of the sample; none negative.
        sizes: their sizes, above 0.
        containers: number of containers of the whole.
        total_size: size of the whole.

    Raises:
        ValueError: of several containers fewer than two were measured, so that nobody knows how they differ.
    """
    measured, known = np.asarray(values, float), np.asarray(sizes, float)
    count = len(measured)
    if count < min(2, containers):
        raise ValueError(f"at least two of {containers} containers must be measured, found {count}")
    rate = measured.sum() / known.sum()
    value = rate * total_size
    if count == containers:
        return Estimate(value=value, low=value, high=value)
    spread = np.sum((measured - rate * known) ** 2) / (count - 1)
    error = containers * sqrt((1 - count / containers) * spread / count)
    reach = float(t.ppf((1 + _COVERED) / 2, count - 1)) * error
    return Estimate(value=value, low=max(measured.sum(), value - reach), high=value + reach)


def scaled(estimate: Estimate, factor: float) -> Estimate:
    """The estimate in another unit."""
    return Estimate(value=estimate.value * factor, low=estimate.low * factor, high=estimate.high * factor)


def shifted(estimate: Estimate, by: float) -> Estimate:
    """The estimate and something that is certain."""
    return Estimate(value=estimate.value + by, low=estimate.low + by, high=estimate.high + by)


def sum_of(estimates: Iterable[Estimate]) -> Estimate:
    """Sum of estimates from one sample: what errs in one of them errs in the others, so that bounds add up."""
    every = list(estimates)
    return Estimate(
        value=sum(one.value for one in every),
        low=sum(one.low for one in every),
        high=sum(one.high for one in every),
    )


def wall_share(seconds: Sequence[float], workers: int) -> float:
    """Time until all tasks are done, as a share of their sum; each goes to the first free worker, the longest first."""
    total = sum(seconds)
    if not total:
        return 1.0 / workers
    free = [0.0] * workers
    for one in sorted(seconds, reverse=True):
        heapq.heappush(free, heapq.heappop(free) + one)
    return max(free) / total
