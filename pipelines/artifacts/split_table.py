"""The table of splits that `wsm split` leaves."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipelines.running.upstream import done_outcomes, vouched_by_ledger
from wsm_data.errors import IntegrityError
from wsm_data.files.json_values import load_json_lines, to_json
from wsm_data.files.jsonlines import write_lines
from wsm_data.schema.identity import EpisodeId

SPLIT_FILE = "split.jsonl"


@dataclass(frozen=True, kw_only=True)
class _Row:
    id: str
    split: str


def write_split(folder: Path, splits: Mapping[EpisodeId, str]) -> None:
    """Write the split of every trajectory, in the order given."""
    write_lines(folder / SPLIT_FILE, [to_json(_Row(id=one.text, split=split)) for one, split in splits.items()])


def read_split(folder: Path) -> dict[str, str]:
    """Split of every trajectory (`train` or `test`) by its id.

    Raises:
        IntegrityError: the table is not what the stage left, or a line of it is no such row.
    """
    path = folder / SPLIT_FILE
    if not path.exists():
        raise IntegrityError(f"{path} is missing; run `wsm split` again")
    for outcome in done_outcomes(folder).values():
        vouched_by_ledger(folder, outcome, path)
    rows = load_json_lines(_Row, path, "the split of a trajectory", "run `wsm split` again")
    return {row.id: row.split for row in rows}
