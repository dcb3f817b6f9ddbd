"""Mean and standard deviation of latents per channel, over the training split of a release.

Sums are kept as count, mean and squared deviations, because a sum of squares loses the variance where the mean is
large against it. Two of them are merged as in Chan, Golub and LeVeque, "Algorithms for computing the sample variance:
analysis and recommendations", The American Statistician 37 (1983). The result of floating-point additions depends on
their grouping, so a release merges clips one by one in the order in which they stand in its shards.

A latent counts when at least one of the raw frames it covers is real: latents of repeated still frames at the end of a
padded clip would pull the statistics towards last views.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsm_data.schema.arrays import Float16Array, Float64Array, frozen_array
from wsm_data.schema.clip import Clip
from wsm_data.schema.sequence import TEMPORAL_RATIO

STD_FLOOR = 1e-6
"""Least standard deviation, in latent units: a constant channel is divided by this, not by zero."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LatentSums:
    """What has to be known of latents to merge them with others.

    Attributes:
        count: values per channel.
        mean: mean per channel; float64 [C].
        squared_deviations: sum of (x - mean)^2 per channel; float64 [C].
    """

    count: int
    mean: Float64Array
    squared_deviations: Float64Array

    def to_json(self) -> dict[str, object]:
        """JSON object; float64 survives it to the bit."""
        return {
            "count": self.count,
            "mean": self.mean.tolist(),
            "squared_deviations": self.squared_deviations.tolist(),
        }

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "LatentSums":
        """Inverse of `to_json`."""
        return cls(
            count=int(record["count"]),
            mean=np.array(record["mean"], np.float64),
            squared_deviations=np.array(record["squared_deviations"], np.float64),
        )


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
        mean=np.asarray(frozen_array(mean)),
        squared_deviations=np.asarray(frozen_array(np.add.reduce(values, axis=0))),
    )


def clip_sums(clip: Clip) -> tuple[LatentSums, LatentSums]:
    """Sums of a clip's colour and depth latents, padding left out."""
    real = real_latents(clip.frame_count, clip.meta.padded_frames)
    return latent_sums(clip.rgb_latent[:real]), latent_sums(clip.depth_latent[:real])


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
    std = np.maximum(np.sqrt(sums.squared_deviations / sums.count), std_floor)
    return LatentStatistics(count=sums.count, mean=tuple(sums.mean.tolist()), std=tuple(std.tolist()))


def _merge(a: LatentSums, b: LatentSums) -> LatentSums:
    count = a.count + b.count
    delta = b.mean - a.mean
    return LatentSums(
        count=count,
        mean=a.mean + delta * (b.count / count),
        squared_deviations=a.squared_deviations + b.squared_deviations + delta * delta * (a.count * b.count / count),
    )
