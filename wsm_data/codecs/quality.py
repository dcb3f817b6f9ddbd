"""What a codec costs: PSNR of colour, and metres of depth error by distance, in sums that can be merged over clips."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import BoolArray, Float32Array

DEPTH_EDGES_M = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
"""Borders of the distance ranges that are reported, m; the outer two are those of the paper's depth range."""

_PEAK_TO_PEAK = 2.0  # of a video in [-1, 1]


def psnr_db(reference: Float32Array, decoded: Float32Array) -> float:
    """Peak signal-to-noise ratio of two videos in [-1, 1], dB; infinite where they are equal.

    Raises:
        ValueError: the shapes differ.
    """
    squared_error_sum, values = _squared_errors(reference, decoded)
    return psnr_of_sum_db(squared_error_sum, values)


def _squared_errors(reference: Float32Array, decoded: Float32Array) -> tuple[float, int]:
    """Sum of squared differences, and over how many values; frame by frame, to keep float64 copies small."""
    _require_same_shape("decoded", decoded, reference)
    frames = zip(reference, decoded, strict=True)
    return sum(float(np.square(a.astype(np.float64) - b).sum()) for a, b in frames), reference.size


def psnr_of_sum_db(squared_error_sum: float, values: int) -> float:
    """Peak signal-to-noise ratio of so many values in [-1, 1], dB; infinite where the sum of squared errors is 0.

    Raises:
        ValueError: there is no value.
    """
    if not values:
        raise ValueError("PSNR needs at least one value, found none")
    if squared_error_sum == 0:
        return float("inf")
    return float(10 * np.log10(_PEAK_TO_PEAK**2 * values / squared_error_sum))


@dataclass(frozen=True, kw_only=True)
class DepthErrors:
    """Absolute depth errors of valid pixels, summed in ranges of the true depth.

    Attributes:
        edges_m: borders of the n ranges, n + 1 increasing numbers, m; a range holds its lower border, the last one
            both.
        error_sum_m: sum of absolute errors in each range, m.
        counts: valid pixels in each range.
        pixels: all pixels, valid or not, inside the ranges or not.
    """

    edges_m: tuple[float, ...]
    error_sum_m: tuple[float, ...]
    counts: tuple[int, ...]
    pixels: int

    def __post_init__(self) -> None:
        ranges = len(self.edges_m) - 1
        if ranges < 1 or any(low >= high for low, high in zip(self.edges_m, self.edges_m[1:], strict=False)):
            raise ValueError(f"edges_m must hold at least two increasing numbers, found {self.edges_m}")
        if len(self.error_sum_m) != ranges or len(self.counts) != ranges:
            raise ValueError(f"{ranges} ranges need as many sums and counts, found {self.error_sum_m}, {self.counts}")

    @property
    def mean_error_m(self) -> tuple[float | None, ...]:
        """Mean absolute error in each range, m; None where no pixel lies."""
        pairs = zip(self.error_sum_m, self.counts, strict=True)
        return tuple(total / count if count else None for total, count in pairs)

    @property
    def shares(self) -> tuple[float, ...]:
        """Valid pixels of each range as a share of all pixels."""
        return tuple(count / self.pixels if self.pixels else 0.0 for count in self.counts)

    def merge(self, other: "DepthErrors") -> "DepthErrors":
        """Errors of both sets of pixels.

        Raises:
            ValueError: the ranges differ.
        """
        if self.edges_m != other.edges_m:
            raise ValueError(f"only errors in equal ranges can be merged, found {self.edges_m} and {other.edges_m}")
        return DepthErrors(
            edges_m=self.edges_m,
            error_sum_m=tuple(a + b for a, b in zip(self.error_sum_m, other.error_sum_m, strict=True)),
            counts=tuple(a + b for a, b in zip(self.counts, other.counts, strict=True)),
            pixels=self.pixels + other.pixels,
        )


def depth_error_by_range(
    reference_m: NDArray[np.floating], decoded_m: NDArray[np.floating], valid: BoolArray, edges_m: Sequence[float]
) -> DepthErrors:
    """Sum absolute depth errors in ranges of the true depth.

    Args:
        reference_m: true depth, any shape, m. Beyond the codec's depth range it cannot be told apart: give it clipped.
        decoded_m: depth after the codec, same shape, m.
        valid: which pixels of the reference are measurements, same shape.
        edges_m: borders of the ranges, m.

    Raises:
        ValueError: the shapes differ, or the borders do not increase.
    """
    _require_same_shape("decoded_m", decoded_m, reference_m)
    _require_same_shape("valid", valid, reference_m)
    true_m = reference_m[valid].astype(np.float64)
    error_m = np.abs(decoded_m[valid] - true_m)
    # In the dtype of the reference, so that depth clipped to the outer border lies on it and not a rounding outside.
    bins = np.asarray(edges_m, reference_m.dtype).astype(np.float64)
    ranges = len(bins) - 1
    number = np.searchsorted(bins, true_m, side="right") - 1  # np.histogram would sort the pixels
    number[true_m == bins[-1]] = ranges - 1
    inside = (number >= 0) & (number < ranges)
    counts = np.bincount(number[inside], minlength=ranges)
    sums = np.bincount(number[inside], weights=error_m[inside], minlength=ranges)
    return DepthErrors(
        edges_m=tuple(float(edge) for edge in edges_m),
        error_sum_m=tuple(sums.tolist()),
        counts=tuple(counts.tolist()),
        pixels=int(reference_m.size),
    )


def _require_same_shape(name: str, array: np.ndarray, reference: np.ndarray) -> None:
    if array.shape != reference.shape:
        raise ValueError(f"{name} must have the reference's shape {list(reference.shape)}, found {list(array.shape)}")


@dataclass(frozen=True, kw_only=True)
class CodecQuality:
    """Quality of a codec on some clips, as sums. Merge clips in a fixed order: float addition is not associative.

    Attributes:
        clips: how many clips were measured.
        frames: how many of their frames; 0 where that was not written down.
        squared_error_sum: squared colour errors, with colours in [-1, 1].
        values: colour values measured.
        depth: depth errors by range.
    """

    clips: int
    squared_error_sum: float
    values: int
    depth: DepthErrors
    frames: int = 0

    @property
    def psnr_db(self) -> float:
        """PSNR of the pooled squared error of all clips, dB."""
        return psnr_of_sum_db(self.squared_error_sum, self.values)

    def merge(self, other: "CodecQuality") -> "CodecQuality":
        """Quality on the clips of both.

        Raises:
            ValueError: the depth ranges differ.
        """
        return CodecQuality(
            clips=self.clips + other.clips,
            squared_error_sum=self.squared_error_sum + other.squared_error_sum,
            values=self.values + other.values,
            depth=self.depth.merge(other.depth),
            frames=self.frames + other.frames,
        )


def clip_quality(reference: Float32Array, decoded: Float32Array, depth: DepthErrors) -> CodecQuality:
    """Quality on one clip, from its colour video in [-1, 1] before and after the codec and its depth errors.

    Raises:
        ValueError: the shapes differ.
    """
    squared_error_sum, values = _squared_errors(reference, decoded)
    return CodecQuality(clips=1, squared_error_sum=squared_error_sum, values=values, depth=depth, frames=len(reference))
