"""Mean and standard deviation of latents per channel, over the training split of a release.

Sums are kept as count, mean and squared deviations, because a sum of squares loses the variance where the mean is
large against it. Two of them are merged as in Chan, Golub and LeVeque, "Algorithms for computing the sample variance:
analysis and recommendations", The American Statistician 37 (1983). The result of floating-point additions depends on
their grouping, so a release merges clips one by one in the order in which they stand in its shards.

A latent counts when at least one of the raw frames it covers is real: latents of repeated still frames at the end of a
padded clip would pull the statistics towards last views.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float16Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.sequence import TEMPORAL_RATIO

STD_FLOOR = 1e-6
"""Least standard deviation, in latent units: a constant channel is divided by this, not by zero."""


@dataclass(frozen=True, kw_only=True)
class LatentSums:
    """What has to be known of latents to merge them with others.

    Attributes:
        count: values per channel.
        mean: mean per channel.
        squared_deviations: sum of (x - mean)^2 per channel.
    """

    count: int
    mean: tuple[float, ...]
    squared_deviations: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class LatentStatistics:
    """Mean and standard deviation of latents.

    Attributes:
        count: values per channel; 0 in a release without training clips.
        mean: per channel; empty when nothing was counted.
        std: population standard deviation per channel, at least `STD_FLOOR`; empty when nothing was counted.
    """

    count: int
    mean: tuple[float, ...]
    std: tuple[float, ...]


def real_latents(frames: int, padded_frames: int) -> int:
    """How many leading latents cover at least one raw frame that is not padding.

    Raises:
        ValueError: not one frame is real.
    """
    if not 0 <= padded_frames < frames:
        raise ValueError(f"a clip of {frames} frames must have 0 to {frames - 1} padded ones, found {padded_frames}")
    return 1 + (frames - 1) // TEMPORAL_RATIO - padded_frames // TEMPORAL_RATIO


def latent_sums(latent: Float16Array) -> LatentSums:
    """Sums over the frames and cells of a latent [F, C, h, w].

    Values are added one after the other along frame, row and column, per channel, in float64: the result does not
    depend on the width of the machine's vector units, as a sum along the fastest axis would.
    """
    channels = latent.shape[1]
    values = np.ascontiguousarray(latent.transpose(0, 2, 3, 1), np.float64).reshape(-1, channels)
    mean = np.add.reduce(values, axis=0) / len(values)
    values -= mean
    values *= values
    return LatentSums(
        count=len(values),
        mean=tuple(mean.tolist()),
        squared_deviations=tuple(np.add.reduce(values, axis=0).tolist()),
    )


def clip_sums(clip: Clip) -> tuple[LatentSums, LatentSums | None]:
    """Sums of a clip's colour and depth latents, padding left out; None for the depth that it does not have."""
    real = real_latents(clip.frame_count, clip.meta.padded_frames)
    depth = clip.depth_latent
    return latent_sums(clip.rgb_latent[:real]), None if depth is None else latent_sums(depth[:real])


def merge_sums(sums: Iterable[LatentSums]) -> LatentSums | None:
    """Merge one after the other, in the order given; None where there is nothing to merge."""
    merged: LatentSums | None = None
    for item in sums:
        merged = item if merged is None else _merge(merged, item)
    return merged


def latent_statistics(sums: LatentSums | None, std_floor: float = STD_FLOOR) -> LatentStatistics:
    """Mean and population standard deviation of merged sums."""
    if sums is None:
        return LatentStatistics(count=0, mean=(), std=())
    std = np.maximum(np.sqrt(np.array(sums.squared_deviations) / sums.count), std_floor)
    return LatentStatistics(count=sums.count, mean=sums.mean, std=tuple(std.tolist()))


def _merge(a: LatentSums, b: LatentSums) -> LatentSums:
    count = a.count + b.count
    mean = np.array(a.mean)
    delta = np.array(b.mean) - mean
    squared = np.array(a.squared_deviations) + np.array(b.squared_deviations)
    return LatentSums(
        count=count,
        mean=tuple((mean + delta * (b.count / count)).tolist()),
        squared_deviations=tuple((squared + delta * delta * (a.count * b.count / count)).tolist()),
    )
