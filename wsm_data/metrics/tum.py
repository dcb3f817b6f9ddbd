"""Trajectories as text, in the format of TUM's RGB-D benchmark: `stamp x y z qx qy qz qw`, camera to world."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.files.atomic import write_text
from wsm_data.geometry.transform import transforms_from_vectors, vectors_from_transforms
from wsm_data.schema.arrays import Float64Array, frozen_array, require_array, require_finite

_COLUMNS = 8
_XYZW_OF_WXYZ = [1, 2, 3, 0]


@dataclass(frozen=True, kw_only=True)
class StampedTrajectory:
    """Camera poses and their times.

    Attributes:
        stamps_s: rising; float64 [T].
        T_world_camera: OpenCV camera to world, m, or of no scale where the estimate has none; float64 [T, 4, 4].
    """

    stamps_s: Float64Array
    T_world_camera: Float64Array

    def __post_init__(self) -> None:
        require_array("stamps_s", self.stamps_s, np.float64, (None,))
        require_array("T_world_camera", self.T_world_camera, np.float64, (len(self.stamps_s), 4, 4))
        for name in ("stamps_s", "T_world_camera"):
            require_finite(name, getattr(self, name))
            object.__setattr__(self, name, frozen_array(getattr(self, name)))
        if not (np.diff(self.stamps_s) > 0).all():
            raise ValueError("stamps_s must rise from one to the next")

    @property
    def centres_m(self) -> Float64Array:
        """Camera centres in the world; float64 [T, 3]."""
        return self.T_world_camera[:, :3, 3]


def write_tum(path: Path, trajectory: StampedTrajectory) -> None:
    """Write a trajectory atomically; numbers have 9 decimals, quaternions w >= 0."""
    vectors = vectors_from_transforms(trajectory.T_world_camera)
    rows = np.column_stack([trajectory.stamps_s, vectors[:, :3], vectors[:, 3:][:, _XYZW_OF_WXYZ]])
    write_text(path, "".join(" ".join(f"{value + 0.0:.9f}" for value in row) + "\n" for row in rows.tolist()))


def read_tum(path: Path) -> StampedTrajectory:
    """Read a trajectory; lines that start with `#` are comments, quaternions are made unit.

    Raises:
        DataError: `trajectory.unreadable`: no file, not 8 finite numbers in a line, a zero quaternion, stamps that do
            not rise, or no line; names the file and the line.
    """
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise _unreadable(path, f"it cannot be read: {error}") from error
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and line.lstrip()[0] != "#"]
    if not numbered:
        raise _unreadable(path, "it has no line with a pose")
    rows = np.array([_numbers(path, number, line) for number, line in numbered])
    if not (np.diff(rows[:, 0]) > 0).all():
        late = numbered[int(np.argmin(np.diff(rows[:, 0]) > 0)) + 1][0]
        raise _unreadable(path, f"stamps must rise, and the one in line {late} does not")
    vectors = np.concatenate([rows[:, 1:4], rows[:, [7, 4, 5, 6]]], axis=1)
    return StampedTrajectory(stamps_s=rows[:, 0].copy(), T_world_camera=transforms_from_vectors(vectors))


def _numbers(path: Path, number: int, line: str) -> list[float]:
    try:
        values = [float(word) for word in line.split()]
    except ValueError as error:
        raise _unreadable(path, f"line {number} holds a word that is no number: {error}") from error
    if len(values) != _COLUMNS or not np.isfinite(values).all():
        raise _unreadable(path, f"line {number} must be 8 finite numbers, found {line[:80]!r}")
    if not any(values[4:]):
        raise _unreadable(path, f"the quaternion in line {number} is zero")
    return values


def _unreadable(path: Path, why: str) -> DataError:
    return DataError(
        Reason.TRAJECTORY_UNREADABLE,
        f"{path} must hold lines of `stamp x y z qx qy qz qw`, but {why}; export the trajectory in TUM's format",
        {"path": path},
    )
