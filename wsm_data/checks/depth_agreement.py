"""Do poses and depth tell of the same world? On failure other meanings of the poses are tried, and what fits is named.

Floor, ceiling and the walls along the way look the same however far the camera moved along them, so a median over all
points would accept nearly any motion. Only points count that can tell: those whose error would be another one had the
camera stood still, or moved the other way; and against each other meaning of the poses, those that tell the two apart.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wsm_data.checks.depth_pairs import DepthPair, depth_pair, relative_errors
from wsm_data.errors import Reason
from wsm_data.geometry.camera import T_STORED_OPENCV
from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

_T_BODY_OPENCV = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""OpenCV camera to a camera stored in body axes (x forward, y left, z up)."""

_SHIFTED, _INVERTED = "those of", "world to camera"

_HALF_TURN = np.diag([-1.0, 1.0, -1.0, 1.0])
"""Half a turn about the camera's vertical axis: the camera looks backwards."""

_STORED_AXES: Mapping[str, Float64Array] = {**T_STORED_OPENCV, "body (x forward, y left, z up)": _T_BODY_OPENCV}


_DEPTH_SCALES: Mapping[str, float] = {f"depth were divided by {scale:g}": scale for scale in (5.0, 10.0, 1000.0, 0.2)}
"""Units that are mistaken for one another: millimetres, metres, 1/10 mm, and the 1/5000 m of TUM's benchmark. Depth
that is far too small tells nothing: the poses lead out of all that it shows."""

MAX_POINTS = 1200
"""So many pixels of a frame are compared at most."""

MIN_POINTS = 50
"""A pair counts from so many points that can tell,"""

MIN_SHARE = 0.02
"""and from this share of the points that both frames see: fewer lie at edges and behind corners."""

MIN_DECIDING_SHARE = 0.03
"""Another meaning of the poses is better where so large a share of all points that are seen tells the two apart,"""

MIN_DECIDING_PAIRS = 3
"""in so many pairs, or, in fewer pairs,"""

LARGE_DECIDING_SHARE = 0.1
"""this share of the points does;"""

CLEAR_ERROR = 2.0
"""Poses that are some frames late need that share, or that the error of the own ones is so many limits: with a Kinect's
noise and poses that jitter, 7 % of the points, at slanted surfaces, prefer them by chance and err by one limit;"""

MIN_VOTES = 2 / 3
"""and so large a share of these pairs is for it: the error of one pose is in two pairs at most."""

MAX_MEANING_PAIRS = 8
"""Other meanings are tried in so many of the pairs at most, since one that is right is so in all of them;"""

SHIFTED_FRAMES = 3
"""and in all pairs poses of so many frames before and after, which differ in every direction from poses that drift."""


def check_depth_agreement(
    record: EpisodeRecord,
    depth_m: Mapping[int, Float32Array],
    pairs: Sequence[tuple[int, int]],
    camera_axes: str,
    max_error: float,
) -> Verdict:
    """Refuse a trajectory whose depth contradicts its poses (`pose.depth_disagree`).

    Depth of a frame is unprojected, moved into another frame by the poses, and compared with the depth there. Refused
    is a median error over the limit, over the points that can tell (see the module); and poses that do not fit where
    another meaning of them does, and errs by half at most (noise alone prefers none by that much), over the points that
    tell these two apart: other camera axes, a camera that looks backwards, inverse matrices, poses of some frames
    earlier or later, depth in another unit. A
    pair with too few such points tells nothing, and a trajectory of such pairs alone is kept, with `pairs` = 0.

    Args:
        record: the trajectory.
        depth_m: by frame, depth along the optical axis at the size of the record's intrinsics, m, 0 without
            measurement; float32 [H, W].
        pairs: frames that are compared, each of them in `depth_m`. About half a metre apart they tell most.
        camera_axes: the axes the source's manifest says its poses are stored in, `opengl` or `opencv`.
        max_error: accepted median of |predicted depth / depth there - 1|. A point can tell two motions apart when its
            errors under them differ by more than this. On the real files right axes err by 0.03 mm, wrong ones by 270
            to 820 mm: manifests/datasets/interndata_n1.toml, camera_axes.
    """
    compared = [depth_pair(a, b, depth_m, record.intrinsics, MAX_POINTS) for a, b in pairs]
    median, used = _median_error(record, compared, max_error)
    meanings = _meanings(record.T_world_camera @ invert(T_STORED_OPENCV[camera_axes]))
    few = compared[:: max(1, -(-len(compared) // MAX_MEANING_PAIRS))]
    errors = _against_own(record, meanings | _rescaled(record.T_world_camera), few, max_error)
    for name, late in _against_own(record, _shifted(record.T_world_camera), compared, max_error).items():
        clear = late[2] >= LARGE_DECIDING_SHARE or late[0] >= CLEAR_ERROR * max_error
        errors[name] = late if clear else (math.nan, math.nan, 0.0)
    better = {
        name: other
        for name, (mine, other, share) in errors.items()
        if mine > max_error and other <= min(max_error, mine / 2) and share > 0
    }
    measured: dict[str, object] = {"pairs": used, "median_relative_error": median}
    limits = {"median_relative_error": max_error}
    if not better and (median is None or median <= max_error):
        return Verdict(measured=measured, limits=limits)
    fits = min(better, key=lambda name: better[name], default=None)
    found = _found(median, used, errors.get(fits or ""))
    message = (
        f"{record.id.text}: depth moved along the poses must agree within {max_error:.0%}, found {found} "
        f"with poses stored as {camera_axes}; {_advice(fits)}"
    )
    tried = {
        name: {"own": mine, "other": other, "deciding_share": share}
        for name, (mine, other, share) in errors.items()
        if math.isfinite(other)
    }
    details = {**measured, "errors_where_they_differ": tried, "fits": fits}
    return Verdict(reason=Reason.POSE_DEPTH_DISAGREE, message=message, measured=details, limits=limits)


def _advice(fits: str | None) -> str:
    """What to do about it, by the meaning that fits."""
    if fits is None:
        return (
            "no other meaning of the poses fits either: poses and images are of different trajectories, or out of step"
        )
    if fits in _DEPTH_SCALES:
        return f"they would agree if {fits}: correct depth.metres_per_unit of the manifest"
    if fits.startswith(_SHIFTED):
        remedy = "they drift, or are out of step with the images; repair the source"
    elif fits.startswith(_INVERTED):
        remedy = "invert them in the source"
    else:
        remedy = "correct the manifest's camera_axes, or the source"
    return f"they would agree if the poses were {fits}: {remedy}"


def _found(median: float | None, pairs: int, best: tuple[float, float, float] | None) -> str:
    """The numbers that decided, in words."""
    if best is not None:
        mine, other, share = best
        return f"{mine:.1%} over the {share:.0%} of the points that tell the two apart, and {other:.1%} otherwise,"
    return f"{median:.1%} in {pairs} pairs of frames"


def _meanings(T_world_stored: Float64Array) -> dict[str, Float64Array]:
    """What the stored matrices could mean: each of the camera axes, looking backwards, and the matrices inverted."""
    plain = {name: T_world_stored @ T_stored_opencv for name, T_stored_opencv in _STORED_AXES.items()}
    turned = {f"{name}, turned by 180 degrees of yaw": T @ _HALF_TURN for name, T in plain.items()}
    inverse = invert(T_world_stored)
    return plain | turned | {f"{_INVERTED}, {name}": inverse @ T for name, T in _STORED_AXES.items()}


def _shifted(T_world_camera: Float64Array) -> dict[str, Float64Array]:
    """The image of frame t has the pose of a frame before or after it; NaN where there is none."""
    n = min(SHIFTED_FRAMES, len(T_world_camera))
    missing = np.full((n, 4, 4), np.nan)
    return {
        f"{_SHIFTED} {n} frames later": np.concatenate([T_world_camera[n:], missing]),
        f"{_SHIFTED} {n} frames earlier": np.concatenate([missing, T_world_camera[:-n]]),
    }


def _rescaled(T_world_camera: Float64Array) -> dict[str, Float64Array]:
    """Depth in another unit: relative errors are those of this depth along a way that is as many times longer."""
    rescaled = {}
    for name, scale in _DEPTH_SCALES.items():
        rescaled[name] = T_world_camera.copy()
        rescaled[name][:, :3, 3] *= scale
    return rescaled


def _median_error(record: EpisodeRecord, pairs: Sequence[DepthPair], max_error: float) -> tuple[float | None, int]:
    """Median error over the points that can tell, of all pairs with enough of them, and the number of such pairs."""
    told = []
    for pair in pairs:
        T_b_a = invert(record.T_world_camera[pair.b]) @ record.T_world_camera[pair.a]
        motions = np.stack([T_b_a, np.eye(4), _HALF_TURN @ T_b_a @ _HALF_TURN])
        mine, still, back = relative_errors(pair, motions, record.intrinsics)
        tells = _differ(mine, still, max_error) | _differ(mine, back, max_error)
        if _enough(tells, mine):
            told.append(np.abs(mine[tells]))
    return (float(np.median(np.concatenate(told))) if told else None), len(told)


def _against_own(
    record: EpisodeRecord, meanings: Mapping[str, Float64Array], pairs: Sequence[DepthPair], max_error: float
) -> dict[str, tuple[float, float, float]]:
    """By meaning, the median errors of a record's own poses and of these, and the share of points that tell them apart.

    NaN where these are too few, or pairs do not tell the same.
    """
    told: dict[str, list[Float64Array]] = {name: [] for name in meanings}
    seen = 0
    for pair in pairs:
        every = np.stack([record.T_world_camera, *meanings.values()])
        mine, *others = relative_errors(pair, invert(every[:, pair.b]) @ every[:, pair.a], record.intrinsics)
        seen += int(np.count_nonzero(np.isfinite(mine)))
        for name, other in zip(meanings, others, strict=True):
            tells = _differ(mine, other, max_error)
            if _enough(tells, mine):
                told[name].append(np.abs([mine[tells], other[tells]]))
    return {name: _decided(one, seen, max_error) for name, one in told.items()}


def _decided(told: Sequence[Float64Array], seen: int, max_error: float) -> tuple[float, float, float]:
    """Median errors [own, other] over pairs of [2, N] errors of the points that tell, and their share of those seen.

    NaN too where the own poses err by no more than the limit in most points: they need no other meaning.
    """
    if not told:
        return math.nan, math.nan, 0.0
    both = np.concatenate(told, axis=1)
    if 2 * np.count_nonzero(both[0] > max_error) < both.shape[1]:
        return math.nan, math.nan, 0.0
    votes = np.mean([np.median(mine) > np.median(other) for mine, other in told])
    least = MIN_DECIDING_SHARE if len(told) >= MIN_DECIDING_PAIRS else LARGE_DECIDING_SHARE
    if both.shape[1] < least * seen or votes < MIN_VOTES:
        return math.nan, math.nan, 0.0
    mine_median, other_median = np.median(both, axis=1).tolist()
    return mine_median, other_median, both.shape[1] / seen


def _differ(one: Float64Array, other: Float64Array, max_error: float) -> BoolArray:
    """Points that both motions show, with errors further apart than the limit."""
    return np.abs(one - other) > max_error  # NaN, where one does not show it, is not greater


def _enough(tells: BoolArray, errors: Float64Array) -> bool:
    count = np.count_nonzero(tells)
    return bool(count >= max(MIN_POINTS, MIN_SHARE * np.count_nonzero(np.isfinite(errors))))
