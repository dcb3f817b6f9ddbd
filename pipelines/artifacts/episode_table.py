"""The table of trajectories that `wsm index` leaves and every later stage starts from."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wsm_data.errors import IntegrityError
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
        "intrinsics": asdict(record.intrinsics),
        "camera_height_m": record.camera_height_m,
        "camera_pitch_rad": record.camera_pitch_rad,
        "notes": record.notes,
    }
    digest = hashlib.sha256(canonical_json(stated).encode())
    digest.update(np.ascontiguousarray(record.T_world_camera, "<f8").tobytes())
    return digest.hexdigest()


def write_episodes(folder: Path, rows: Iterable[EpisodeRow]) -> None:
    """Write the table, sorted by id."""
    ordered = sorted(rows, key=lambda row: row.id)
    write_lines(folder / EPISODES_FILE, [{**vars(row), "id": row.id.text} for row in ordered])


def read_episodes(folder: Path) -> list[EpisodeRow]:
    """All accepted trajectories, sorted by id.

    Raises:
        IntegrityError: the table is gone although the stage says that it is done.
    """
    if not (folder / EPISODES_FILE).exists():
        raise IntegrityError(f"{folder / EPISODES_FILE} is missing; run `wsm index` again")
    return [row_from_json(line) for line in read_lines(folder / EPISODES_FILE)]


def row_from_json(line: Mapping[str, Any]) -> EpisodeRow:
    """A row from the JSON object that stands for it in the table and among the facts of its container."""
    return EpisodeRow(**{**line, "id": EpisodeId.parse(line["id"])})
