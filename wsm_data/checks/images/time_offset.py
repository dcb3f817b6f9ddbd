"""Do poses and images belong to the same moments?

Poses that are some frames late differ from the right ones by how the motion changes, often less than a sensor's noise
in any single pair of frames. So pairs from the whole trajectory are held against the poses of some frames earlier and
later, each point by a cost that is bounded, and offsets are judged by the sum: noise prefers none of them, and a
minority of points or of pairs decides nothing. Where frames were dropped or doubled, the offset holds from some frame
on; pairs of frames on both sides of it tell that by a whole frame's motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wsm_data.checks.images.video_warp import pair_motions, warp_errors
from wsm_data.errors import Reason
from wsm_data.geometry.smoothing import smoothed_poses
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.arrays import Float32Array, Float64Array, Int64Array
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

MAX_OFFSET_FRAMES = 3
"""Poses up to so many frames earlier and later are tried."""

WAY_M = 0.5
"""Way between the frames of a pair; one radian of turning counts as a metre of it."""

MAX_PAIRS = 128
MAX_POINTS = 160
MIN_POINTS = 20
MIN_PAIRS = 12

SMOOTHING_FRAMES = 3
SMOOTHER = 0.8
"""Poses are smoothed over so many frames to either side where that leaves this share of the error: they jitter then,
and each of them says less of its moment than its neighbours do together."""

MIN_SCALE = 2e-4
"""The cost of an error e is e^2 / (e^2 + s^2), with s twice the median under the best offset, and not below this: the
rounding of depth."""

MIN_CHANGE = 0.75
"""An offset of all poses is told only where one frame changes the motions of pairs by so many times the jitter of the
poses. Straight ahead at constant speed the jitter alone is left of it, 0.3 times."""

MIN_LENGTH = 1e-4
"""Changes of motion below it, m or rad, tell nothing."""

MIN_GAIN = 0.05
MIN_VOTES = 0.58
MIN_DEVIATIONS = 1.5
"""Another offset must lower the cost by such a share, in so large a share of the pairs, and in the mean by so many of
its standard errors. Where motion changes that much, others raise the cost of sound poses."""

MIN_CROSSING_PAIRS = 6
MIN_CROSSING_GAIN = 0.35
MIN_CROSSING_VOTES = 0.75
"""The same of an offset from a frame on, in the few pairs of frames on both sides of it, where the frame is the one of
all that suits best."""

MIN_CONTRAST = 0.25
SIDE_PAIRS = 3
"""And the same poses must fit the pairs that end just before that frame, or begin just behind it, less well by so much
of the cost: a slip begins and ends from one pair to the next. Where few points are seen, and these at the rims of
things, other poses may suit some pairs in a row better; then they mostly suit their neighbours too. In 800 sound
trajectories of generated homes seven gained 0.3 to 0.83 so, with contrasts of 0.01 to 0.16, and one gained 0.32 with
0.28; slips planted in 70 of them gained and stood out by more in nine of ten that are told without this limit."""

_OFFSETS = tuple(sorted(range(-MAX_OFFSET_FRAMES, MAX_OFFSET_FRAMES + 1), key=abs))
_OTHERS = _OFFSETS[1:]
_HYPOTHESES = [(k, k) for k in _OFFSETS] + [(0, k) for k in _OTHERS] + [(k, 0) for k in _OTHERS]
"""Offsets of the poses of both frames of a pair: the same, from a frame between them on, and up to it."""


@dataclass(frozen=True, kw_only=True)
class PairCosts:
    """What pairs of frames say of every hypothesis.

    Attributes:
        first: first frame of each pair; int64 [P], ascending.
        lag: frames from the first to the second.
        change: how much one frame changes the motions of pairs, over the jitter of the poses.
        costs: mean cost of the points of each pair, in [0, 1]; float64 [P, hypotheses].
    """

    first: Int64Array
    lag: int
    change: float
    costs: Float64Array


@dataclass(frozen=True, kw_only=True)
class Offset:
    """An offset of the poses, and how much speaks for it.

    Attributes:
        frames: poses of so many frames later fit.
        start: first frame of which it holds, and
        stop: the first after it of which it does not.
        gain: share of the cost that it takes away.
        votes: share of the pairs whose cost it lowers.
        deviations: its mean gain in standard errors.
        pairs: so many tell.
        contrast: how much more it gains than in the neighbouring pairs; 0 for all poses.
    """

    frames: int
    start: int
    stop: int
    gain: float
    votes: float
    deviations: float
    pairs: int
    contrast: float = 0.0


def check_time_offset(record: EpisodeRecord, video: Float32Array, depth_range: DepthRange) -> Verdict:
    """Refuse a trajectory whose poses are some frames early or late, wholly or from a frame on (`pose.out_of_step`).

    Motion that never changes tells no offset of all frames, and a camera that stands still tells none at all: these are
    kept.

    Args:
        record: the trajectory.
        video: its normalised log-depth, 2u - 1, without measurement +1; float32 [T, H, W] of any size.
        depth_range: range of the video.
    """
    pairs = pair_costs(record, video, depth_range)
    if len(pairs.first) < MIN_PAIRS:
        return Verdict(measured={"offset_pairs": len(pairs.first)})
    whole, part = whole_offset(pairs, len(video)), partial_offset(pairs, len(video))
    measured: dict[str, object] = {
        "offset_pairs": whole.pairs,
        "offset_gain": whole.gain,
        "motion_change_over_jitter": pairs.change,
    }
    limits: dict[str, object] = {"offset_gain": MIN_GAIN, "motion_change_over_jitter": MIN_CHANGE}
    if part is not None:
        measured |= {"offset_change_gain": part.gain, "offset_change_contrast": part.contrast}
        limits |= {"offset_change_gain": MIN_CROSSING_GAIN, "offset_change_contrast": MIN_CONTRAST}
    found = next((one for one in (whole, part) if one is not None and is_clear(one, pairs)), None)
    if found is None:
        return Verdict(measured=measured, limits=limits)
    frames = f"{abs(found.frames)} frame{'s' if abs(found.frames) > 1 else ''}"
    where = "" if found is whole else f" in frames {found.start} to {found.stop - 1}"
    message = (
        f"{record.id.text}: depth must fit the poses of its own moment best, and{where} it fits those of {frames} "
        f"{'later' if found.frames > 0 else 'earlier'} better, by {found.gain:.0%} of the error in {found.votes:.0%} "
        f"of {found.pairs} pairs of frames; move poses against images there, or put back the images that are missing"
    )
    details = {
        **measured,
        "offset_frames": found.frames,
        "first_frame": found.start,
        "votes": found.votes,
        "deviations": found.deviations,
    }
    return Verdict(reason=Reason.POSE_OUT_OF_STEP, message=message, measured=details, limits=limits)


def pair_costs(record: EpisodeRecord, video: Float32Array, depth_range: DepthRange) -> PairCosts:
    """Pairs of frames `WAY_M` apart, over the whole trajectory, and their costs under every hypothesis."""
    smooth = smoothed_poses(record.T_world_camera, SMOOTHING_FRAMES)
    first, lag = _spread_pairs(smooth, len(video))
    intrinsics = record.intrinsics.resized(video.shape[2], video.shape[1])

    def errors_of(
        poses: Float64Array, numbers: Int64Array, hypotheses: Sequence[tuple[int, int]]
    ) -> list[Float64Array]:
        motions = pair_motions(poses, numbers, numbers + lag, hypotheses)
        return [
            warp_errors(video, a, a + lag, of_pair, intrinsics, depth_range, MAX_POINTS)
            for a, of_pair in zip(numbers.tolist(), motions, strict=True)
        ]

    own, smoothed = (_median(errors_of(poses, first[::4], [(0, 0)])) for poses in (record.T_world_camera, smooth))
    poses = smooth if smoothed < SMOOTHER * own else record.T_world_camera
    errors = errors_of(poses, first, _HYPOTHESES)
    told = [at for at, one in enumerate(errors) if len(one) >= MIN_POINTS]
    if not told:
        return PairCosts(first=first[:0], lag=lag, change=0.0, costs=np.zeros((0, len(_HYPOTHESES))))
    kept = [errors[at] for at in told]
    medians = np.median(np.concatenate(kept)[:, : len(_OFFSETS)], axis=0)
    scale = max(MIN_SCALE, 2 * float(medians.min()))
    costs = np.array([np.mean(one**2 / (one**2 + scale**2), axis=0) for one in kept])
    change = _change_over_jitter(record.T_world_camera, smooth, first[told], lag)
    return PairCosts(first=first[told], lag=lag, change=change, costs=costs)


def whole_offset(pairs: PairCosts, frames: int) -> Offset:
    """The offset of all poses that costs least."""
    total = pairs.costs[:, : len(_OFFSETS)].sum(axis=0)
    best = 1 + int(np.argmin(total[1:]))
    gains = pairs.costs[:, 0] - pairs.costs[:, best]
    return _offset(_OFFSETS[best], 0, frames, gains, pairs.costs[:, 0], pairs)


def partial_offset(pairs: PairCosts, frames: int) -> Offset | None:
    """The offset of the poses from a frame on, or up to one, that costs least; None where too few pairs tell it.

    Its gain and votes are those of the pairs of frames on both sides of that frame. One that stands out from the
    neighbouring pairs is preferred to all that do not.
    """
    starts = np.arange(pairs.first[0] + 1, pairs.first[-1] + 1)
    end = np.searchsorted(pairs.first, starts)  # pairs before it begin before the frame,
    begin = np.searchsorted(pairs.first + pairs.lag, starts)  # and from here on they end behind it
    whole = end - begin >= max(MIN_CROSSING_PAIRS, np.max(end - begin, initial=0) - 1)
    best: tuple[float, int, int, int, float] | None = None
    for column in range(len(_OFFSETS), len(_HYPOTHESES)):
        crossing = np.concatenate([[0.0], np.cumsum(pairs.costs[:, 0] - pairs.costs[:, column])])
        other = 1 + (column - len(_OFFSETS)) % len(_OTHERS)
        beside = np.concatenate([[0.0], np.cumsum(pairs.costs[:, 0] - pairs.costs[:, other])])
        later = column < len(_OFFSETS) + len(_OTHERS)
        gains = crossing[end] - crossing[begin] + (beside[-1] - beside[end] if later else beside[begin])
        contrast = _contrast(crossing, begin, end)
        rank = np.where(whole, gains, -np.inf) + 2 * MAX_PAIRS * (contrast >= MIN_CONTRAST)  # more than any gain
        at = int(np.argmax(rank))
        if whole[at] and (best is None or rank[at] > best[0]):
            best = float(rank[at]), column, at, other, float(contrast[at])
    if best is None:
        return None
    _, column, at, other, stands_out = best
    across = slice(int(begin[at]), int(end[at]))
    own = pairs.costs[across, 0]
    start, stop = (int(starts[at]), frames) if column < len(_OFFSETS) + len(_OTHERS) else (0, int(starts[at]))
    offset = _offset(_OFFSETS[other], start, stop, own - pairs.costs[across, column], own, pairs)
    return replace(offset, contrast=stands_out)


def _contrast(gained: Float64Array, begin: Int64Array, end: Int64Array) -> Float64Array:
    """Mean gain of pairs `begin` to `end` above that of `SIDE_PAIRS` before, or behind, whichever is less.

    The one pair next to them counts on neither side: frames that look alike let a slip be told one off. Without any
    neighbour there is no contrast.

    Args:
        gained: sums of the gains of all pairs before each; float64 [P + 1].
        begin: first pairs across each frame; int64 [N].
        end: behind the last ones.
    """
    last = len(gained) - 1
    across = (gained[end] - gained[begin]) / np.maximum(end - begin, 1)
    sides = []
    for low, high in ((begin - 1 - SIDE_PAIRS, begin - 1), (end + 1, end + 1 + SIDE_PAIRS)):
        low, high = np.clip(low, 0, last), np.clip(high, 0, last)
        mean = (gained[high] - gained[low]) / np.maximum(high - low, 1)
        sides.append(np.where(high > low, mean, -np.inf))
    most = np.maximum(*sides)
    return np.where(np.isfinite(most), across - most, 0.0)


def _offset(
    offset_frames: int, start: int, stop: int, gains: Float64Array, own: Float64Array, pairs: PairCosts
) -> Offset:
    step = max(1.0, float(np.median(np.diff(pairs.first))))
    return Offset(
        frames=offset_frames,
        start=start,
        stop=stop,
        gain=float(gains.sum() / max(own.sum(), 1e-12)),
        votes=float(np.mean(gains > 0)),
        deviations=float(gains.mean() / max(_standard_error(gains, round(pairs.lag / step)), 1e-12)),
        pairs=len(gains),
    )


def _standard_error(values: Float64Array, lag: int) -> float:
    """Of the mean of values that are correlated up to a lag (Newey and West 1987: weights fall linearly)."""
    centred = values - values.mean()
    count = len(values)
    total = float(centred @ centred)
    for behind in range(1, min(lag, count - 1) + 1):
        total += 2 * (1 - behind / (lag + 1)) * float(centred[behind:] @ centred[:-behind])
    return float(np.sqrt(max(total, 0.0)) / count)


def is_clear(offset: Offset, pairs: PairCosts) -> bool:
    """Whether noise does not make that much of an offset."""
    if offset.pairs < len(pairs.first):
        stands_out = offset.contrast >= MIN_CONTRAST
        return stands_out and offset.gain >= MIN_CROSSING_GAIN and offset.votes >= MIN_CROSSING_VOTES
    told = pairs.change >= MIN_CHANGE and offset.deviations >= MIN_DEVIATIONS
    return told and offset.gain >= MIN_GAIN and offset.votes >= MIN_VOTES


def _change_over_jitter(T_world_camera: Float64Array, smooth: Float64Array, first: Int64Array, lag: int) -> float:
    """Root mean square of what one frame changes in the motions of pairs, over that of what smoothing takes away."""
    now, then = (invert(smooth[first + k + lag]) @ smooth[first + k] for k in (0, 1))
    inner = slice(SMOOTHING_FRAMES, len(smooth) - SMOOTHING_FRAMES)
    change, jitter = _lengths(invert(now) @ then), _lengths((invert(smooth) @ T_world_camera)[inner])
    return float(np.max(change / np.maximum(jitter, MIN_LENGTH)))


def _lengths(T: Float64Array) -> Float64Array:
    """Root mean squares of the ways and the angles of motions [N, 4, 4]; float64 [2], m and rad."""
    squares = [np.sum(T[:, :3, 3] ** 2, axis=1), rotation_angle_rad(T[:, :3, :3]) ** 2]
    return np.sqrt(np.mean(squares, axis=1))


def _spread_pairs(T_world_camera: Float64Array, frames: int) -> tuple[Int64Array, int]:
    """First frames of pairs, spread evenly, as far from the ends as poses are shifted; and the frames between them."""
    inner = frames - 2 * MAX_OFFSET_FRAMES
    if inner < MIN_PAIRS:
        return np.zeros(0, np.int64), 0
    steps_m = np.linalg.norm(np.diff(T_world_camera[:, :3, 3], axis=0), axis=1)
    turns_rad = rotation_angle_rad((invert(T_world_camera[:-1]) @ T_world_camera[1:])[:, :3, :3])
    way_m = float(np.mean(steps_m + turns_rad))
    lag = int(np.clip(round(WAY_M / max(way_m, WAY_M / inner)), 2, inner // 2))
    last = frames - MAX_OFFSET_FRAMES - lag - 1
    spread = np.linspace(MAX_OFFSET_FRAMES, last, min(MAX_PAIRS, last - MAX_OFFSET_FRAMES + 1))
    return np.rint(spread).astype(np.int64), lag


def _median(errors: Sequence[Float64Array]) -> float:
    every = np.concatenate([*errors, np.zeros((0, 1))])
    return float(np.median(every)) if len(every) else 0.0
