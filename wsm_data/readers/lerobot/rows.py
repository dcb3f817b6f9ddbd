"""The rows of an episode: times, poses and camera, as its features of numbers say."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.quaternion import matrices_from_quaternions
from wsm_data.readers.lerobot.meta import EpisodePlace, unreadable
from wsm_data.readers.tum.poses import in_project_axes
from wsm_data.readers.unreadable import open_file
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.source.lerobot_features import PoseForm

_NUMBERS = {PoseForm.MATRIX: 16, PoseForm.XYZ_WXYZ: 7, PoseForm.XYZ_XYZW: 7}


@dataclass(frozen=True, kw_only=True)
class EpisodeRows:
    """What the table of an episode says of its N frames.

    Attributes:
        times_s: since the episode began, s; float64 [N].
        T_world_camera: in the project's axes; float64 [N, 4, 4].
        intrinsics: fx, fy, cx, cy, px; None where no feature says it.
    """

    times_s: Float64Array
    T_world_camera: Float64Array
    intrinsics: tuple[float, float, float, float] | None


def read_rows(root: Path, place: EpisodePlace, dataset: DatasetManifest, where: str) -> EpisodeRows:
    """Read the rows of one episode.

    Raises:
        DataError: a `table.*` or `pose.*` reason, `file.unreadable`, or `intrinsics.misfit`.
    """
    features = dataset.features
    names = ["episode_index", "frame_index", "timestamp", features.pose]
    names += [features.intrinsics] if features.intrinsics else []
    table = _own_rows(root, place, names, where)
    if table.num_rows != place.length and place.length is not None:
        raise DataError(
            Reason.TABLE_ROW_COUNT,
            f"{where} must have the {place.length} rows that the table of episodes says, found {table.num_rows}; fetch "
            "it again",
            {"rows": table.num_rows, "expected": place.length},
        )
    frames = np.asarray(table["frame_index"].to_numpy(), np.int64)
    if not np.array_equal(frames, np.arange(len(frames))) or not len(frames):
        raise DataError(Reason.TABLE_ROW_ORDER, f"{where}: frame_index must rise by one from 0; export it again")
    if len(frames) > dataset.limits.max_frames:
        raise DataError(Reason.EPISODE_TOO_LONG, f"{where} must have at most {dataset.limits.max_frames} frames")
    times_s = np.asarray(table["timestamp"].to_numpy(), np.float64)
    if not np.isfinite(times_s).all() or (np.diff(times_s) <= 0).any():
        raise DataError(Reason.TABLE_ROW_ORDER, f"{where}: timestamp must be finite and rise; export it again")
    return EpisodeRows(
        times_s=times_s,
        T_world_camera=_poses(table, dataset, where),
        intrinsics=_intrinsics(table, features.intrinsics, where) if features.intrinsics else None,
    )


def _own_rows(root: Path, place: EpisodePlace, names: Sequence[str], where: str) -> pa.Table:
    """The rows of the episode, in the order of the file; of a shared file only the groups that hold some are read."""
    with open_file(root / place.data_file, place.data_file) as file:
        stored = pq.ParquetFile(file).schema_arrow.names
        if missing := [name for name in names if name not in stored]:
            raise DataError(
                Reason.TABLE_MISSING_COLUMN,
                f"{where} must have the features {', '.join(missing)}, found {', '.join(stored)}; name them in "
                "[features] of the manifest",
                {"missing": missing},
            )
        file.seek(0)
        try:
            return pq.read_table(file, columns=list(names), filters=[("episode_index", "=", place.index)])
        except pa.ArrowInvalid as error:
            raise unreadable(f"{place.data_file} must be a table, but {error}") from error


def _values(table: pa.Table, name: str, counts: Sequence[int], where: str) -> Float64Array:
    """A feature of as many numbers in every row, nested or flat; float64 [N, count]."""
    rows = [np.ravel(np.asarray(row, dtype=np.float64)) for row in table[name].to_pylist()]
    sizes = {len(row) for row in rows}
    if len(sizes) != 1 or not sizes <= set(counts):
        raise DataError(
            Reason.TABLE_BAD_SHAPE,
            f"{where}: {name} must hold {' or '.join(map(str, counts))} numbers in every row, found "
            f"{sorted(sizes)[:5]}",
            {"feature": name, "found": sorted(sizes)[:5]},
        )
    values = np.stack(rows)
    if not np.isfinite(values).all():
        row = int(np.argwhere(~np.isfinite(values))[0][0])
        raise DataError(
            Reason.POSE_NOT_FINITE, f"{where}: {name} must be finite, and is not in row {row}", {"row": row}
        )
    return values


def _poses(table: pa.Table, dataset: DatasetManifest, where: str) -> Float64Array:
    features = dataset.features
    values = _values(table, features.pose, [_NUMBERS[features.pose_form]], where)
    if features.pose_form is PoseForm.MATRIX:
        T = values.reshape(-1, 4, 4)
    else:
        T = np.tile(np.eye(4), (len(values), 1, 1))
        T[:, :3, 3] = values[:, :3]
        wxyz = values[:, 3:] if features.pose_form is PoseForm.XYZ_WXYZ else values[:, [6, 3, 4, 5]]
        norms = np.linalg.norm(wxyz, axis=1, keepdims=True)
        if (np.abs(norms - 1) > 1e-2).any():
            raise DataError(
                Reason.POSE_NOT_RIGID,
                f"{where}: {features.pose} must hold unit quaternions, found a norm of {float(norms.min()):.3g}; is "
                "features.pose_form right?",
            )
        T[:, :3, :3] = matrices_from_quaternions(wxyz / norms)
    return in_project_axes(T, dataset.files, dataset.camera_axes, features.pose, where)


def _intrinsics(table: pa.Table, name: str, where: str) -> tuple[float, float, float, float]:
    values = _values(table, name, [4, 9], where)
    if (values != values[0]).any():
        raise DataError(Reason.INTRINSICS_MISFIT, f"{where}: {name} must be the same in every row, and changes")
    first = values[0] if values.shape[1] == 4 else values[0][[0, 4, 2, 5]]
    fx, fy, cx, cy = first.tolist()
    return fx, fy, cx, cy
