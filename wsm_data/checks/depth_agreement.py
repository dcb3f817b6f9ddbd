"""Do poses and depth tell of the same world? On failure camera axes are tried out, and those that fit are named."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wsm_data.errors import Reason
from wsm_data.geometry.camera import T_STORED_OPENCV, project, unproject
from wsm_data.geometry.transform import invert, rotation_angle_rad, transform_points
from wsm_data.schema.arrays import Float32Array, Float64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Verdict

_T_BODY_OPENCV = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""OpenCV camera to a camera stored in body axes (x forward, y left, z up)."""

_STORED_AXES: Mapping[str, Float64Array] = {**T_STORED_OPENCV, "body (x forward, y left, z up)": _T_BODY_OPENCV}


@dataclass(frozen=True, kw_only=True)
class DepthAgreementConfig:
    """How agreement is measured.

    With exact depth a right pose errs by the rounding of the depth, 1e-4; wrong axes err by twice the motion, 4 % for
    0.06 m at 3 m (spec/interndata_n1.md: 0.03 mm against 270 to 820 mm).

    Attributes:
        max_median_error: accepted median of |predicted depth / depth there - 1|.
        max_pairs: pairs of frames that are compared, spread over the trajectory.
        pixel_stride: every n-th pixel of every n-th row is compared.
        min_motion_m: a pair tells nothing when the camera moved less,
        min_motion_deg: and turned less, degrees.
        min_points: a pair counts from so many points that both frames see.
        max_edge_ratio: points at depth edges do not count: the four pixels around differ by more than this ratio.
    """

    max_median_error: float = 0.02
    max_pairs: int = 6
    pixel_stride: int = 4
    min_motion_m: float = 0.03
    min_motion_deg: float = 2.0
    min_points: int = 50
    max_edge_ratio: float = 1.1


def check_depth_agreement(
    record: EpisodeRecord,
    depth_m: Mapping[int, Float32Array],
    camera_axes: str,
    config: DepthAgreementConfig | None = None,
) -> Verdict:
    """Refuse a trajectory whose depth contradicts its poses (`pose.depth_disagree`).

    Depth of a frame is unprojected, moved into the next given frame, and compared with the depth there. A pair of
    frames that see nothing in common, or between which the camera stood still, tells nothing; a trajectory of such
    pairs alone is kept, with `pairs` = 0.

    Args:
        record: the trajectory.
        depth_m: by frame, depth along the optical axis at the size of the record's intrinsics, m, 0 without
            measurement; float32 [H, W]. Frames about half a metre apart tell most.
        camera_axes: the axes the source's manifest says its poses are stored in, `opengl` or `opencv`.
        config: limits.
    """
    config = config or DepthAgreementConfig()
    pairs = _pairs(record.T_world_camera, sorted(depth_m), config)
    median, used = _median_error(record.T_world_camera, record.intrinsics, depth_m, pairs, config)
    measured: dict[str, object] = {"pairs": used, "median_relative_error": median}
    if used == 0 or (median is not None and median <= config.max_median_error):
        return Verdict(measured=measured)
    T_world_stored = record.T_world_camera @ invert(T_STORED_OPENCV[camera_axes])
    errors = {
        name: _median_error(T_world_camera, record.intrinsics, depth_m, pairs, config)[0]
        for name, T_world_camera in _conventions(T_world_stored).items()
    }
    fitting = [name for name, error in errors.items() if error is not None and error <= config.max_median_error]
    advice = (
        f"stored as {fitting[0]} they would agree: correct camera_axes in the manifest, or the source"
        if fitting
        else "no other camera axes fit either: poses and images are of different trajectories, or out of step"
    )
    message = (
        f"{record.id.text}: depth moved along the poses must agree within {config.max_median_error:.0%}, found "
        f"{median:.1%} in {used} pairs of frames, with poses stored as {camera_axes}; {advice}"
    )
    details = {**measured, "error_by_convention": errors, "fits": fitting[0] if fitting else None}
    return Verdict(reason=Reason.POSE_DEPTH_DISAGREE, message=message, measured=details)


def _conventions(T_world_stored: Float64Array) -> dict[str, Float64Array]:
    """What the stored matrices could mean: each of the camera axes, and the same matrices the other way round."""
    meanings = {name: T_world_stored @ T_stored_opencv for name, T_stored_opencv in _STORED_AXES.items()}
    inverse = invert(T_world_stored)
    return meanings | {f"world to camera, {name}": inverse @ T for name, T in _STORED_AXES.items()}


def _pairs(T_world_camera: Float64Array, frames: list[int], config: DepthAgreementConfig) -> list[tuple[int, int]]:
    """Neighbouring frames between which the camera moved, spread evenly over the trajectory."""
    moved = []
    for a, b in pairwise(frames):
        T_b_a = invert(T_world_camera[b]) @ T_world_camera[a]
        angle_deg = np.rad2deg(rotation_angle_rad(T_b_a[:3, :3]))
        if np.linalg.norm(T_b_a[:3, 3]) >= config.min_motion_m or angle_deg >= config.min_motion_deg:
            moved.append((a, b))
    chosen = np.unique(np.linspace(0, len(moved) - 1, min(len(moved), config.max_pairs)).round().astype(int))
    return [moved[index] for index in chosen]


def _median_error(
    T_world_camera: Float64Array,
    intrinsics: Intrinsics,
    depth_m: Mapping[int, Float32Array],
    pairs: list[tuple[int, int]],
    config: DepthAgreementConfig,
) -> tuple[float | None, int]:
    """Median error over the points of all pairs that see enough in common, and the number of such pairs."""
    errors = [
        _pair_errors(invert(T_world_camera[b]) @ T_world_camera[a], intrinsics, depth_m[a], depth_m[b], config)
        for a, b in pairs
    ]
    enough = [error for error in errors if len(error) >= config.min_points]
    return (float(np.median(np.concatenate(enough))) if enough else None), len(enough)


def _pair_errors(
    T_b_a: Float64Array,
    intrinsics: Intrinsics,
    depth_a_m: Float32Array,
    depth_b_m: Float32Array,
    config: DepthAgreementConfig,
) -> Float64Array:
    """|predicted depth / depth there - 1| of the points of frame a that frame b sees too; float64 [N]."""
    stride = config.pixel_stride
    points_a = unproject(depth_a_m.astype(np.float64), intrinsics)[::stride, ::stride].reshape(-1, 3)
    points_b = transform_points(T_b_a, points_a[points_a[:, 2] > 0])
    pixels, z_m = project(points_b, intrinsics)
    corner = np.floor(pixels).astype(np.int64)
    height, width = depth_b_m.shape
    inside = (z_m > 0) & (corner >= 0).all(axis=1) & (corner[:, 0] < width - 1) & (corner[:, 1] < height - 1)
    corner, fraction, z_m = corner[inside], (pixels - corner)[inside], z_m[inside]
    around_m = np.stack([depth_b_m[corner[:, 1] + dy, corner[:, 0] + dx] for dy in (0, 1) for dx in (0, 1)], axis=1)
    smooth = (around_m > 0).all(axis=1) & (around_m.max(axis=1) <= config.max_edge_ratio * around_m.min(axis=1))
    return np.abs(z_m[smooth] * _inverse_depth(around_m[smooth].astype(np.float64), fraction[smooth]) - 1)


def _inverse_depth(around_m: Float64Array, fraction: Float64Array) -> Float64Array:
    """Inverse depth between four pixels [N, 4], bilinear: exact on planes, where 1 / z is linear in the image."""
    x, y = fraction[:, 0], fraction[:, 1]
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)
    return (weights / around_m).sum(axis=1)
