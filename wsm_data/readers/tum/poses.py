"""Poses of a sequence: read in three forms, turned into the project's axes, and asked for at the times of images."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import T_STORED_OPENCV
from wsm_data.geometry.quaternion import matrices_from_quaternions, quaternions_from_matrices
from wsm_data.geometry.transform import rigidity_error
from wsm_data.metrics.tum import StampedTrajectory, read_tum
from wsm_data.readers.tum.listing import data_lines, numbered_files, unreadable
from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.schema.source.sequence_files import MATRIX_NUMBERS, SequenceFiles, WorldAxes

MAX_RIGIDITY_ERROR = 1e-3
"""A stored matrix may be so far from a rigid one: text files have six digits."""

T_WORLD_STORED: Mapping[WorldAxes, Float64Array] = {
    WorldAxes.Z_UP: np.eye(4),
    WorldAxes.Y_UP: np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    WorldAxes.Y_DOWN: np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),
    WorldAxes.Y_UP_LEFT_HANDED: np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
}
"""From a source's world to the project's, z up."""

_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
"""OpenCV camera to a left-handed one with y up."""


def read_poses(folder: Path, files: SequenceFiles, camera_axes: str, where: str) -> StampedTrajectory:
    """Camera poses of a sequence and their times, OpenCV camera to the project's world.

    Matrices that are not finite, as exporters write them where tracking was lost, are no poses and left out.

    Raises:
        DataError: `sequence.unreadable`, `trajectory.unreadable`, `file.unreadable`, or `pose.not_rigid`.
    """
    stored = _read_stored(folder, files.poses, where)
    T_world_camera = in_project_axes(stored.T_world_camera, files, camera_axes, files.poses, where)
    return StampedTrajectory(stamps_s=np.array(stored.stamps_s), T_world_camera=T_world_camera)


def in_project_axes(
    T_stored: Float64Array, files: SequenceFiles, camera_axes: str, name: str, where: str
) -> Float64Array:
    """Stored poses [N, 4, 4] of a tracked body as those of an OpenCV camera in a world with z up.

    Raises:
        DataError: `pose.not_rigid`: one of them is not, or `files.T_tracked_camera` is not.
    """
    require_rigid(T_stored, name, where)
    mirror = _MIRROR if files.world == WorldAxes.Y_UP_LEFT_HANDED else np.eye(4)
    T_tracked_camera = np.array(files.T_tracked_camera, np.float64).reshape(4, 4)
    require_rigid(T_tracked_camera[None], "files.T_tracked_camera of the manifest", where)
    T_stored_camera = T_tracked_camera @ T_STORED_OPENCV[camera_axes] @ mirror
    return np.asarray(T_WORLD_STORED[files.world] @ T_stored @ T_stored_camera)


def poses_at(trajectory: StampedTrajectory, stamps_s: Float64Array, max_gap_s: float) -> tuple[Float64Array, BoolArray]:
    """Poses at given times: positions interpolated along the line, rotations along the great circle between two poses.

    Args:
        trajectory: poses and their times.
        stamps_s: wanted times, float64 [N].
        max_gap_s: largest distance of the two poses in time; at the very time of a pose none is asked for.

    Returns:
        float64 [N, 4, 4], the identity where no pose can be given; and whether one can, bool [N].
    """
    times = trajectory.stamps_s
    after = np.clip(np.searchsorted(times, stamps_s), 0, len(times) - 1)
    before = np.where(times[after] == stamps_s, after, np.maximum(after - 1, 0))
    gap_s = times[after] - times[before]
    known = (times[before] <= stamps_s) & (stamps_s <= times[after]) & (gap_s <= max_gap_s)
    share = np.where(gap_s > 0, (stamps_s - times[before]) / np.where(gap_s > 0, gap_s, 1.0), 0.0)
    T = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    first, second = trajectory.T_world_camera[before], trajectory.T_world_camera[after]
    T[:, :3, 3] = first[:, :3, 3] + share[:, None] * (second[:, :3, 3] - first[:, :3, 3])
    T[:, :3, :3] = _between(first[:, :3, :3], second[:, :3, :3], share)
    T[~known] = np.eye(4)
    return T, known


def _between(first: Float64Array, second: Float64Array, share: Float64Array) -> Float64Array:
    """Spherical linear interpolation of rotations [N, 3, 3] (Shoemake 1985)."""
    a, b = quaternions_from_matrices(first), quaternions_from_matrices(second)
    cosine = (a * b).sum(axis=1)
    b = np.where(cosine[:, None] < 0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    small = sine < 1e-9
    of_a = np.where(small, 1 - share, np.sin((1 - share) * angle) / np.where(small, 1.0, sine))
    of_b = np.where(small, share, np.sin(share * angle) / np.where(small, 1.0, sine))
    return matrices_from_quaternions(of_a[:, None] * a + of_b[:, None] * b)


def _read_stored(folder: Path, name: str, where: str) -> StampedTrajectory:
    if "*" in name:
        rows = sorted(numbered_files(folder, name, where))
        return _trajectory([(number, _matrix_of_file(folder, file, where)) for number, file in rows], name, where)
    lines = data_lines(folder, name, where)
    if lines and len(lines[0][1]) == MATRIX_NUMBERS:
        numbers = [_numbers(words, MATRIX_NUMBERS, f"line {line} of {name}", where) for line, words in lines]
        return _trajectory([(float(i), T.reshape(4, 4)) for i, T in enumerate(numbers)], name, where)
    return read_tum(folder / name)


def _matrix_of_file(folder: Path, file: str, where: str) -> Float64Array:
    words = [word for _, line in data_lines(folder, file, where) for word in line]
    return _numbers(words, MATRIX_NUMBERS, file, where).reshape(4, 4)


def _numbers(words: list[str], count: int, what: str, where: str) -> Float64Array:
    try:
        values = np.array([float(word) for word in words])
    except ValueError as error:
        raise unreadable(where, f"{what} holds a word that is no number: {error}") from error
    if len(values) != count:
        raise unreadable(where, f"{what} must hold {count} numbers, found {len(values)}")
    return values


def _trajectory(poses: list[tuple[float, Float64Array]], name: str, where: str) -> StampedTrajectory:
    tracked = [(stamp, T) for stamp, T in poses if np.isfinite(T).all()]
    if not tracked:
        raise unreadable(where, f"{name} must hold a pose, and none of {len(poses)} is finite")
    T_world_stored = np.stack([T for _, T in tracked])
    return StampedTrajectory(stamps_s=np.array([stamp for stamp, _ in tracked]), T_world_camera=T_world_stored)


def require_rigid(T_target_source: Float64Array, name: str, where: str) -> None:
    """Refuse matrices [N, 4, 4] of which one is not rigid (`pose.not_rigid`)."""
    error = rigidity_error(T_target_source)
    worst = int(np.argmax(error))
    if error[worst] > MAX_RIGIDITY_ERROR:
        raise DataError(
            Reason.POSE_NOT_RIGID,
            f"{where}: {name} must hold rotations and translations within {MAX_RIGIDITY_ERROR}, and number {worst} is "
            f"{error[worst]:.3g} off; does it have a scale?",
            {"number": worst, "error": error[worst]},
        )
