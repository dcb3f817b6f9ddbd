"""The table of splits that `wsm split` leaves."""

from collections.abc import Mapping
from pathlib import Path

from pipelines.running.upstream import done_outcomes, vouched_by_ledger
from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import read_lines, write_lines
from wsm_data.schema.identity import EpisodeId

SPLIT_FILE = "split.jsonl"


def write_split(folder: Path, splits: Mapping[EpisodeId, str]) -> None:
    """Write the split of every trajectory, in the order given."""
    write_lines(folder / SPLIT_FILE, [{"id": one.text, "split": split} for one, split in splits.items()])


def read_split(folder: Path) -> dict[str, str]:
    """Split of every trajectory (`train` or `test`) by its id.

    Raises:
        IntegrityError: the table is not what the stage left.
    """
    path = folder / SPLIT_FILE
    if not path.exists():
        raise IntegrityError(f"{path} is missing; run `wsm split` again")
    for outcome in done_outcomes(folder).values():
        vouched_by_ledger(folder, outcome, path)
    return {str(line["id"]): str(line["split"]) for line in read_lines(path)}
