"""The table of trajectories that `wsm index` leaves and every later stage starts from."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.running.upstream import vouched_by_record
from wsm_data.errors import IntegrityError
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.jsonlines import canonical_json, read_lines, write_lines
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

EPISODES_FILE = "episodes.jsonl"


@dataclass(frozen=True, kw_only=True)
class EpisodeRow:
    """One accepted trajectory.

    Attributes:
        id: what it is called in every layout.
        container: id of the archive or folder that holds it.
        digest: digest of the stored content, the same in every layout.
        record_digest: digest of what the reader made of it (`record_digest`), the same in every layout too.
        frames: T, raw frames.
        floor_z_m: height of its floor in the world, m.
    """

    id: EpisodeId
    container: str
    digest: str
    record_digest: str
    frames: int
    floor_z_m: float


def record_digest(record: EpisodeRecord) -> str:
    """Digest of all that a record says, except where its files lie: container and member names depend on the layout.

    The content digest covers what is stored. Poses, mount and notes are what the reader makes of that, so a corrected
    reader gives another digest here, and with it another clip.
    """
    stated = {
        "content": record.content_digest,
        "frames": record.frames_digest,
        "intrinsics": to_json(record.intrinsics),
        "camera_height_m": record.camera_height_m,
        "camera_pitch_rad": record.camera_pitch_rad,
        "notes": record.notes,
    }
    if record.goal_world_m is not None:
        stated["goal_world_m"] = record.goal_world_m
    digest = hashlib.sha256(canonical_json(stated).encode())
    digest.update(np.ascontiguousarray(record.T_world_camera, "<f8").tobytes())
    return digest.hexdigest()


def write_episodes(folder: Path, rows: Iterable[EpisodeRow]) -> None:
    """Write the table, sorted by id."""
    write_lines(folder / EPISODES_FILE, [row_json(row) for row in sorted(rows, key=lambda row: row.id)])


def read_episodes(folder: Path) -> list[EpisodeRow]:
    """All accepted trajectories, sorted by id.

    Raises:
        IntegrityError: the table is not what the stage left, or a line of it is no such row.
    """
    path = vouched_by_record(folder, EPISODES_FILE)
    if not path.exists():
        raise IntegrityError(f"{path} is missing; run `wsm index` again")
    try:
        return [row_from_json(line) for line in read_lines(path)]
    except ValueError as error:
        raise IntegrityError(f"{path} must hold a trajectory a line, but: {error}; run `wsm index` again") from error


def row_json(row: EpisodeRow) -> dict[str, Any]:
    """The JSON object that stands for a row in the table and among the facts of its container."""
    return {**to_json(row), "id": row.id.text}


def row_from_json(line: Mapping[str, Any]) -> EpisodeRow:
    """Inverse of `row_json`.

    Raises:
        ValueError: it is none of a row.
    """
    return from_json(EpisodeRow, {**line, "id": to_json(EpisodeId.parse(str(line.get("id"))))})
