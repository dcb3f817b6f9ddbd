"""Do colour images show what depth images and poses say they show?

A point that two frames see has about the same brightness in both, whatever their exposure: the ranks of the points'
brightness must go together. Shuffled, reversed, mirrored or frozen images, and those of another place, have ranks that
do not. Images that are some frames late have ranks that go together less than those of the right frames would.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.checks.depth_pairs import lattice_rays
from wsm_data.errors import Reason
from wsm_data.geometry.camera import project
from wsm_data.geometry.transform import invert, transform_points
from wsm_data.schema.arrays import Float32Array, Float64Array, Int64Array
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

MAX_POINTS = 400
MIN_POINTS = 100
MAX_STEPS = 8
MAX_DEPTH_ERROR = 0.05
"""Points whose predicted depth differs from the depth there by more are hidden from one of the frames."""

LEVELS = 127.5
"""Grey levels in a unit of the videos."""

MIN_SPREAD = 2.0
"""Standard deviation of brightness in grey levels: an image below it shows nothing. One alone may be a wall, close."""

MIN_POINT_SPREAD = 8.0
"""Where the points that two frames see vary by less, noise decides their ranks, and the pair tells nothing."""

LATE_FRAMES = (-5, -3, -2, 2, 3, 5)
LEAST_STEPS = 4
BETTER_BY = 0.05
LEAST_VOTES = 0.75
"""Images are something else where so many pairs, in so large a share of them, correlate by so much more in the median.
Noise makes all correlations lower, and prefers none."""


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """The points that both frames of a step see: frames, and the column and row of each point in both images."""

    a: int
    b: int
    pixels_a: Int64Array
    pixels_b: Int64Array


def check_colour_agreement(
    record: EpisodeRecord,
    green: Float32Array,
    depth_m: Mapping[int, Float32Array],
    steps: Sequence[tuple[int, int]],
    min_correlation: float,
) -> Verdict:
    """Refuse colour images that are blank (`colour.blank`) or do not move with the poses (`colour.disagrees`).

    Args:
        record: the trajectory.
        green: the green of all frames, nearest to brightness, in [-1, 1]; float32 [T, h, w] of any size.
        depth_m: by frame, depth along the optical axis, m, 0 without measurement; float32 [H, W].
        steps: pairs of frames, each of them in `depth_m`; `MAX_STEPS` of them are looked at.
        min_correlation: least median over the steps of Spearman's rank correlation of the points' brightness.
    """
    steps = steps[:: max(1, -(-len(steps) // MAX_STEPS))]
    spread = {number: LEVELS * float(green[number].std()) for step in steps for number in step}
    blank = sorted(number for number, value in spread.items() if value < MIN_SPREAD)
    if 2 * len(blank) > len(spread):
        return _blank(record, blank, spread)
    seen = [_seen_in_both(record, depth_m, step, (green.shape[1], green.shape[2])) for step in steps]
    own = {at: value for at, one in enumerate(seen) if (value := _correlation(green, one, 0)) is not None}
    if not own:
        return Verdict(measured={"colour_steps": 0})
    median = float(np.median(list(own.values())))
    measured: dict[str, object] = {"colour_steps": len(own), "rank_correlation": median}
    limits = {"rank_correlation": min_correlation}
    better, gain = _better(green, seen, own)
    if median >= min_correlation and not better:
        return Verdict(measured=measured, limits=limits)
    advice = (
        f"it would be {gain:.2f} higher if they were {better}"
        if better
        else "are the colour images of this trajectory, in order, upright and not mirrored?"
    )
    message = (
        f"{record.id.text}: the brightness of points that two frames see must correlate by {min_correlation:g} or more "
        f"in rank, and most for the images as they are, found {median:.2f} (median of {len(own)} pairs); {advice}"
    )
    details = {**measured, "fits": better or None, "gain": gain}
    return Verdict(reason=Reason.COLOUR_DISAGREES, message=message, measured=details, limits=limits)


def _blank(record: EpisodeRecord, blank: Sequence[int], spread: Mapping[int, float]) -> Verdict:
    message = (
        f"{record.id.text}: colour images must show something, most vary by {MIN_SPREAD:g} grey levels "
        f"(standard deviation); {len(blank)} of {len(spread)} do not, the first is frame {blank[0]} with "
        f"{spread[blank[0]]:.1f}; repair the source"
    )
    measured = {"frame": blank[0], "frames": len(blank), "min_spread": min(spread.values())}
    return Verdict(reason=Reason.COLOUR_BLANK, message=message, measured=measured, limits={"min_spread": MIN_SPREAD})


def _better(green: Float32Array, seen: Sequence[_Seen], own: Mapping[int, float]) -> tuple[str, float]:
    """What the images would have to be to fit clearly better, and by how much; the empty text where nothing does."""
    best, gained = "", 0.0
    if 2 * sum(value <= 1 - BETTER_BY for value in own.values()) < LEAST_STEPS:
        return best, gained  # no correlation exceeds 1, so that too few pairs could gain as much
    for name, (other, frames) in _alternatives(green).items():
        others = {at: _correlation(other, seen[at], frames) for at in own}
        gains = [value - own[at] for at, value in others.items() if value is not None]
        if len(gains) < LEAST_STEPS or np.mean(np.array(gains) > 0) < LEAST_VOTES:
            continue
        gain = float(np.median(gains))
        if gain >= max(BETTER_BY, gained):
            best, gained = name, gain
    return best, gained


def _alternatives(green: Float32Array) -> dict[str, tuple[Float32Array, int]]:
    """Images turned over, in reverse, or of other frames: views of the video, and an offset in frames."""
    turned = {"mirrored": green[:, :, ::-1], "upside down": green[:, ::-1], "in reverse order": green[::-1]}
    late = {
        f"those of {abs(frames)} frames {'later' if frames > 0 else 'earlier'}": (green, frames)
        for frames in LATE_FRAMES
    }
    return {**{name: (view, 0) for name, view in turned.items()}, **late}


def _correlation(green: Float32Array, seen: _Seen, late: int) -> float | None:
    """Spearman's correlation of the brightness of points that both frames see, in images so many frames later."""
    a, b = seen.a + late, seen.b + late
    if len(seen.pixels_a) < MIN_POINTS or not (min(a, b) >= 0 and max(a, b) < len(green)):
        return None
    one, other = green[a][tuple(seen.pixels_a.T)], green[b][tuple(seen.pixels_b.T)]
    if min(one.std(), other.std()) < MIN_POINT_SPREAD / LEVELS:
        return None
    ranks = [np.argsort(np.argsort(values, kind="stable"), kind="stable") for values in (one, other)]
    return float(np.asarray(np.corrcoef(ranks))[0, 1])


def _seen_in_both(
    record: EpisodeRecord, depth_m: Mapping[int, Float32Array], step: tuple[int, int], size: tuple[int, int]
) -> _Seen:
    """Points on a square lattice of frame a that frame b sees too; pixels are those of images of `size`."""
    a, b = step
    intrinsics = record.intrinsics
    stride = int(np.ceil(np.sqrt(depth_m[a].size / MAX_POINTS)))
    lattice_m = depth_m[a][::stride, ::stride].astype(np.float64)
    rows, columns = np.nonzero(lattice_m > 0)
    own = np.stack([columns, rows], axis=1) * stride
    points_m = (lattice_rays(intrinsics, stride) * lattice_m[..., None])[rows, columns]
    T_b_a = invert(record.T_world_camera[b]) @ record.T_world_camera[a]
    pixels, ahead_m = project(transform_points(T_b_a, points_m), intrinsics)
    column, row = np.rint(pixels).T
    inside = (ahead_m > 0) & (column >= 0) & (row >= 0) & (column < intrinsics.width) & (row < intrinsics.height)
    there_m = depth_m[b][row[inside].astype(int), column[inside].astype(int)]
    shown = np.abs(there_m - ahead_m[inside]) < MAX_DEPTH_ERROR * ahead_m[inside]
    scale = np.array([size[1] / intrinsics.width, size[0] / intrinsics.height])
    return _Seen(
        a=a,
        b=b,
        pixels_a=_rows_columns(own[inside][shown], scale, size),
        pixels_b=_rows_columns(pixels[inside][shown], scale, size),
    )


def _rows_columns(pixels: Float64Array, scale: Float64Array, size: tuple[int, int]) -> Int64Array:
    """(column, row) of one image size to the nearest (row, column) of another."""
    nearest = np.rint((pixels + 0.5) * scale - 0.5).astype(np.int64)
    return np.clip(nearest, 0, np.array([size[1], size[0]]) - 1)[:, ::-1]
