"""Do colour images show what depth images and poses say they show?

A point that two frames see has about the same brightness in both, whatever their exposure: the ranks of the points'
brightness must go together. Shuffled, reversed, mirrored or frozen images, and those of another place, have ranks that
do not.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from wsm_data.errors import Reason
from wsm_data.geometry.camera import pixel_rays, project
from wsm_data.geometry.transform import invert, transform_points
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

MAX_POINTS = 1600
MIN_POINTS = 100
MAX_DEPTH_ERROR = 0.05
"""Points whose predicted depth differs from the depth there by more are hidden from one of the frames."""

MIN_SPREAD = 2.0
"""Standard deviation of brightness in grey levels: an image below it shows nothing. One alone may be a wall, close."""

MIN_POINT_SPREAD = 8.0
"""Where the points that two frames see vary by less, noise decides their ranks, and the pair tells nothing."""


def check_colour_agreement(
    record: EpisodeRecord,
    rgb_u8: Mapping[int, Uint8Array],
    depth_m: Mapping[int, Float32Array],
    steps: Sequence[tuple[int, int]],
    min_correlation: float,
) -> Verdict:
    """Refuse colour images that are blank (`colour.blank`) or do not move with the poses (`colour.disagrees`).

    Args:
        record: the trajectory.
        rgb_u8: by frame, colour image; uint8 [H, W, 3].
        depth_m: by frame, depth along the optical axis, m, 0 without measurement; float32 [H, W], as large as colour.
        steps: pairs of frames, each of them in both.
        min_correlation: least median over the steps of Spearman's rank correlation of the points' brightness.
    """
    grey = {number: image.mean(axis=-1, dtype=np.float32) for number, image in rgb_u8.items()}
    spread = {number: float(image.std()) for number, image in grey.items()}
    blank = sorted(number for number, value in spread.items() if value < MIN_SPREAD)
    if 2 * len(blank) > len(spread):
        message = (
            f"{record.id.text}: colour images must show something, most vary by {MIN_SPREAD:g} grey levels "
            f"(standard deviation); {len(blank)} of {len(spread)} do not, the first is frame {blank[0]} with "
            f"{spread[blank[0]]:.1f}; repair the source"
        )
        measured = {"frame": blank[0], "frames": len(blank), "min_spread": min(spread.values())}
        return Verdict(
            reason=Reason.COLOUR_BLANK, message=message, measured=measured, limits={"min_spread": MIN_SPREAD}
        )
    found = [_correlation(grey, depth_m, step, record) for step in steps]
    told = [value for value in found if value is not None]
    if not told:
        return Verdict(measured={"colour_steps": 0})
    median = float(np.median(told))
    measured, limits = {"colour_steps": len(told), "rank_correlation": median}, {"rank_correlation": min_correlation}
    if median >= min_correlation:
        return Verdict(measured=measured, limits=limits)
    message = (
        f"{record.id.text}: the brightness of points that two frames see must correlate by {min_correlation:g} or more "
        f"in rank, found {median:.2f} (median of {len(told)} pairs of frames); are the colour images of this "
        "trajectory, in order, upright and not mirrored?"
    )
    return Verdict(reason=Reason.COLOUR_DISAGREES, message=message, measured=measured, limits=limits)


def _correlation(
    grey: Mapping[int, Float32Array], depth_m: Mapping[int, Float32Array], step: tuple[int, int], record: EpisodeRecord
) -> float | None:
    """Spearman's correlation of the brightness of the points that both frames of a step see; None for too few."""
    a, b = step
    T_b_a = invert(record.T_world_camera[b]) @ record.T_world_camera[a]
    one, other = _seen_in_both(grey[a], depth_m[a], grey[b], depth_m[b], T_b_a, record.intrinsics)
    if len(one) < MIN_POINTS or min(one.std(), other.std()) < MIN_POINT_SPREAD:
        return None
    ranks = [np.argsort(np.argsort(values, kind="stable"), kind="stable") for values in (one, other)]
    return float(np.asarray(np.corrcoef(ranks))[0, 1])


def _seen_in_both(
    grey_a: Float32Array,
    depth_a_m: Float32Array,
    grey_b: Float32Array,
    depth_b_m: Float32Array,
    T_b_a: Float64Array,
    intrinsics: Intrinsics,
) -> tuple[Float32Array, Float32Array]:
    """Brightness of points on a square lattice of frame a, and of the pixel of frame b that shows each."""
    stride = int(np.ceil(np.sqrt(depth_a_m.size / MAX_POINTS)))
    lattice_m = depth_a_m[::stride, ::stride].astype(np.float64)
    points_m = transform_points(
        T_b_a, (pixel_rays(intrinsics)[::stride, ::stride] * lattice_m[..., None])[lattice_m > 0]
    )
    pixels, ahead_m = project(points_m, intrinsics)
    column, row = np.rint(pixels).T
    inside = (ahead_m > 0) & (column >= 0) & (row >= 0) & (column < intrinsics.width) & (row < intrinsics.height)
    column, row = column[inside].astype(int), row[inside].astype(int)
    shown = np.abs(depth_b_m[row, column] - ahead_m[inside]) < MAX_DEPTH_ERROR * ahead_m[inside]
    own = grey_a[::stride, ::stride][lattice_m > 0][inside]
    return own[shown], grey_b[row, column][shown]
