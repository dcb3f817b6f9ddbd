"""The parquet table of an episode: one intrinsic matrix, one mount, one camera pose a frame."""

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.transform import rigidity_error
from wsm_data.schema.arrays import Float64Array

INTRINSIC_COLUMN = "observation.camera_intrinsic"
MOUNT_COLUMN = "observation.camera_extrinsic"
POSE_COLUMN = "action"
INDEX_COLUMN = "index"

RIGIDITY_TOLERANCE = 1e-3
"""Largest accepted `rigidity_error`. Rotations rounded to float32 err by 4e-7, products of some such matrices by 1e-5;
1e-3 moves a point 5 m away by 5 mm, and a scaled, sheared or mirrored matrix is far beyond it."""

MOUNT_TOLERANCE = 1e-5
"""Largest change of a mount entry (m, or without unit) that is rounding of float32 and not a change."""

INTRINSIC_TOLERANCE_PX = 1e-3
"""Largest change of an intrinsic, px: float32 resolves 3e-5 px at 500 px."""


@dataclass(frozen=True, kw_only=True)
class EpisodeTable:
    """What the table of T frames says; the values are as stored (float32), held as float64.

    Attributes:
        K: camera matrix in pixels; float64 [3, 3].
        T_mount: mount of the camera on the robot, in the source's camera axes; float64 [4, 4].
        T_world_stored: camera to world, in the source's camera axes, m; float64 [T, 4, 4].
    """

    K: Float64Array
    T_mount: Float64Array
    T_world_stored: Float64Array


def read_table(data: memoryview, where: str, max_rows: int) -> EpisodeTable:
    """Read the parquet file of an episode; matrices may be nested or flat.

    Args:
        data: the file's bytes.
        where: what to call it in messages.
        max_rows: a table that declares more is refused before any of it is decoded.

    Raises:
        DataError: `table.unreadable`, `table.too_large`, `table.missing_column`, `table.bad_shape`, `table.row_order`
            when there is an index and it does not count the rows up by one, `pose.not_finite`, `pose.not_rigid`,
            `intrinsics.misfit` or `mount.misfit` when they are not finite or change within the episode.
    """
    table = _read_columns(data, where, max_rows)
    if INDEX_COLUMN in table.column_names:
        _require_row_order(table, where)
    K = _matrices(table, INTRINSIC_COLUMN, 3, where)
    T_mount = _matrices(table, MOUNT_COLUMN, 4, where)
    T_world_stored = _matrices(table, POSE_COLUMN, 4, where)
    _require_finite(K, Reason.INTRINSICS_MISFIT, INTRINSIC_COLUMN, where)
    _require_finite(T_mount, Reason.POSE_NOT_FINITE, MOUNT_COLUMN, where)
    _require_finite(T_world_stored, Reason.POSE_NOT_FINITE, POSE_COLUMN, where)
    _require_rigid(T_mount[:1], MOUNT_COLUMN, where)
    _require_rigid(T_world_stored, POSE_COLUMN, where)
    _require_constant(K, INTRINSIC_TOLERANCE_PX, Reason.INTRINSICS_MISFIT, INTRINSIC_COLUMN, where)
    _require_constant(T_mount, MOUNT_TOLERANCE, Reason.MOUNT_MISFIT, MOUNT_COLUMN, where)
    return EpisodeTable(K=K[0], T_mount=T_mount[0], T_world_stored=T_world_stored)


def _read_columns(data: memoryview, where: str, max_rows: int) -> pa.Table:
    columns = [INTRINSIC_COLUMN, MOUNT_COLUMN, POSE_COLUMN]
    try:
        with pq.ParquetFile(pa.BufferReader(data)) as file:
            present = file.schema_arrow.names
            absent = [column for column in columns if column not in present]
            wanted = [*columns, *({INDEX_COLUMN} & set(present))]
            _require_size(file.metadata, wanted, where, max_rows)
            table = None if absent else file.read(columns=wanted, use_threads=False)
    except (pa.ArrowException, OSError) as error:
        message = f"{where}: must be a parquet file, and cannot be read ({error}); download it again"
        raise DataError(Reason.TABLE_UNREADABLE, message, {"bytes": len(data)}) from error
    if table is None:
        raise DataError(
            Reason.TABLE_MISSING_COLUMN,
            f"{where}: must have the columns {', '.join(columns)}; {', '.join(absent)} is missing",
            {"missing": absent, "present": present},
        )
    if table.num_rows == 0:
        raise DataError(Reason.TABLE_BAD_SHAPE, f"{where}: must have a row for every frame, found none", {"rows": 0})
    return table


def _require_size(metadata: pq.FileMetaData, wanted: list[str], where: str, max_rows: int) -> None:
    """Compare what the footer declares, rows and values in nested lists, with what a table of matrices can hold."""
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    leaves = [group.column(number) for group in groups for number in range(group.num_columns)]
    values = sum(leaf.num_values for leaf in leaves if leaf.path_in_schema.split(".")[0] in wanted)
    most = max_rows * sum((9, 16, 16, 1))  # the matrices, and the index
    if metadata.num_rows > max_rows or values > most:
        raise DataError(
            Reason.TABLE_TOO_LARGE,
            f"{where}: a table must have at most {max_rows:,} rows and {most:,} values, and declares "
            f"{metadata.num_rows:,} and {values:,}; if it is right, raise max_frames in [limits] of the manifest",
            {"rows": metadata.num_rows, "values": values, "max_rows": max_rows},
        )


def _require_row_order(table: pa.Table, where: str) -> None:
    """Images are matched to rows by position, so the rows must stand in the order of the frames, from any start."""
    values = table.column(INDEX_COLUMN).combine_chunks()
    if not pa.types.is_integer(values.type) or values.null_count:
        found = f"{values.type} with {values.null_count} nulls"
        raise DataError(
            Reason.TABLE_BAD_SHAPE,
            f"{where}: column {INDEX_COLUMN} must hold a whole number a row, found {found}",
            {"column": INDEX_COLUMN, "type": str(values.type), "nulls": values.null_count},
        )
    index = values.to_numpy(zero_copy_only=False)
    wrong = np.flatnonzero(index[1:] != index[:-1] + 1)
    if len(wrong):
        row = int(wrong[0]) + 1
        raise DataError(
            Reason.TABLE_ROW_ORDER,
            f"{where}: column {INDEX_COLUMN} must rise by one from row to row, but row {row} has {index[row]} after "
            f"{index[row - 1]}; which pose belongs to which image cannot be told, fetch or repair the table",
            {"row": row, "index": int(index[row]), "index_before": int(index[row - 1]), "rows": len(index)},
        )


def _matrices(table: pa.Table, column: str, side: int, where: str) -> Float64Array:
    """A column of square matrices, nested or flat, as float64 [T, side, side]."""
    values = table.column(column).combine_chunks()
    lengths = []
    while isinstance(values, pa.Array) and _is_list(values.type) and values.null_count == 0:
        present = pc.unique(pc.list_value_length(values)).to_pylist()
        lengths.append(present[0] if len(present) == 1 else present)
        values = values.flatten()
    numeric = pa.types.is_floating(values.type) or pa.types.is_integer(values.type)
    if lengths not in ([side * side], [side, side]) or not numeric or values.null_count:
        expected = f"lists of {side * side} numbers or of {side} lists of {side}"
        raise DataError(
            Reason.TABLE_BAD_SHAPE,
            f"{where}: column {column} must hold {expected}, without nulls; found list lengths {lengths} of "
            f"{values.type} with {values.null_count} nulls",
            {"column": column, "lengths": lengths, "type": str(values.type), "nulls": values.null_count},
        )
    return np.asarray(values.to_numpy(zero_copy_only=False), np.float64).reshape(-1, side, side)


def _is_list(kind: pa.DataType) -> bool:
    return bool(pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind))


def _require_finite(matrices: Float64Array, reason: Reason, column: str, where: str) -> None:
    bad = np.flatnonzero(~np.isfinite(matrices).all(axis=(1, 2)))
    if len(bad):
        message = f"{where}: column {column} must be finite, and is not in {len(bad)} rows, the first is row {bad[0]}"
        raise DataError(reason, message, {"column": column, "rows": len(bad), "first_row": int(bad[0])})


def _require_rigid(T_target_source: Float64Array, column: str, where: str) -> None:
    error = rigidity_error(T_target_source)
    worst = int(error.argmax())
    if error[worst] > RIGIDITY_TOLERANCE:
        raise DataError(
            Reason.POSE_NOT_RIGID,
            f"{where}: column {column} must hold a rotation and a translation; row {worst} is off by "
            f"{error[worst]:.3g}, {RIGIDITY_TOLERANCE:g} is accepted",
            {"column": column, "row": worst, "rigidity_error": float(error[worst])},
        )


def _require_constant(matrices: Float64Array, tolerance: float, reason: Reason, column: str, where: str) -> None:
    change = np.abs(matrices - matrices[0]).max(axis=(1, 2))
    worst = int(change.argmax())
    if change[worst] > tolerance:
        raise DataError(
            reason,
            f"{where}: column {column} must be the same in every row of an episode; row {worst} differs from row 0 by "
            f"{change[worst]:.3g}, {tolerance:g} is accepted",
            {"column": column, "row": worst, "change": float(change[worst])},
        )
