"""Episode records in a parquet file: the same records give the same bytes, and come back equal to the last bit."""

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from wsm_data.errors import IntegrityError
from wsm_data.files.tables import opened_table, read_full, write_table
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

_INTRINSICS = ("fx", "fy", "cx", "cy", "width", "height")

_SCHEMA = pa.schema(
    [
        pa.field(name, kind, nullable=False)
        for name, kind in (
            ("id", pa.string()),
            ("container", pa.string()),
            ("rgb_members", pa.list_(pa.field("element", pa.string(), nullable=False))),
            ("depth_members", pa.list_(pa.field("element", pa.string(), nullable=False))),
            ("T_world_camera", pa.list_(pa.field("element", pa.float64(), nullable=False))),
            ("fx", pa.float64()),
            ("fy", pa.float64()),
            ("cx", pa.float64()),
            ("cy", pa.float64()),
            ("width", pa.int64()),
            ("height", pa.int64()),
            ("camera_height_m", pa.float64()),
            ("camera_pitch_rad", pa.float64()),
            ("frames_digest", pa.string()),
            ("content_digest", pa.string()),
            ("notes", pa.list_(pa.field("element", pa.string(), nullable=False))),
            ("goal_world_m", pa.list_(pa.field("element", pa.float64(), nullable=False))),
        )
    ]
)


def write_records(path: Path, records: Iterable[EpisodeRecord]) -> None:
    """Write records atomically, in the given order."""
    rows = list(records)
    columns = [pa.array([_cell(row, field.name) for row in rows], field.type) for field in _SCHEMA]
    write_table(path, pa.Table.from_arrays(columns, schema=_SCHEMA), compression="zstd")


def read_records(path: Path) -> tuple[EpisodeRecord, ...]:
    """Read what `write_records` wrote.

    Raises:
        IntegrityError: the file is absent, damaged, is not such a table, or holds a record that cannot be.
    """
    try:
        must_be, remedy = f"{path} must be a table of episode records", "run `wsm index` again"
        with opened_table(partial(path.open, "rb"), must_be, remedy) as file:
            return tuple(_record(row) for row in read_full(file, _SCHEMA).to_pylist())
    except FileNotFoundError as error:
        raise IntegrityError(f"{path} is missing; run `wsm index` again") from error


def _cell(record: EpisodeRecord, column: str) -> object:
    if column == "id":
        return record.id.text
    if column == "T_world_camera":
        return record.T_world_camera.ravel()
    if column == "goal_world_m":
        return record.goal_world_m or ()
    return getattr(record.intrinsics if column in _INTRINSICS else record, column)


def _record(row: Mapping[str, Any]) -> EpisodeRecord:
    values = dict(row)
    values["intrinsics"] = Intrinsics(**{name: values.pop(name) for name in _INTRINSICS})
    values["id"] = EpisodeId.parse(str(row["id"]))
    values["T_world_camera"] = np.array(row["T_world_camera"], np.float64).reshape(-1, 4, 4)
    for name in ("rgb_members", "depth_members", "notes"):
        values[name] = tuple(row[name])
    values["goal_world_m"] = tuple(row["goal_world_m"]) or None
    return EpisodeRecord(**values)
