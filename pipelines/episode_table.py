"""The table of trajectories that `wsm index` leaves and every later stage starts from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import read_lines, write_lines
from wsm_data.schema.identity import EpisodeId

EPISODES_FILE = "episodes.jsonl"


@dataclass(frozen=True, kw_only=True)
class EpisodeRow:
    """One accepted trajectory.

    Attributes:
        id: what it is called in every layout.
        container: id of the archive or folder that holds it.
        digest: content digest, the same in every layout.
        frames: T, raw frames.
        floor_z_m: height of its floor in the world, m.
        notes: reason codes of what was accepted but is worth knowing; they may change while the content does not.
    """

    id: EpisodeId
    container: str
    digest: str
    frames: int
    floor_z_m: float
    notes: tuple[str, ...] = ()


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
    return EpisodeRow(**{**line, "id": EpisodeId.parse(line["id"]), "notes": tuple(line["notes"])})
