"""What went into a run, unit by unit, and what became of it: the evidence that nothing was lost."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from pipelines.episode_table import read_episodes
from pipelines.folder import refusal_json
from pipelines.upstream import pending_units, quarantine_of
from wsm_data.schema.verdict import Refusal
from wsm_data.shards.inventory import InventoryRow, UnitState


def inventory_of(index: Path, encode: Path, splits: Mapping[str, str], clips: Mapping[str, str]) -> list[InventoryRow]:
    """One row for every trajectory, refused container and pending container of a run.

    The container of a clip is left out: it tells the layout of the source, and a release does not depend on it.

    Args:
        index: folder of `wsm index`.
        encode: folder of `wsm encode`.
        splits: split of every accepted trajectory, by its id.
        clips: ids of the trajectories that became clips, with their content digests.
    """
    refusals = {refusal.unit: refusal for refusal in (*quarantine_of(index), *quarantine_of(encode))}
    rows = [_refused_row(refusal) for refusal in refusals.values()]
    rows += [InventoryRow(unit=unit, container=unit, state=UnitState.PENDING) for unit in pending_units(index)]
    for row in read_episodes(index):
        name = row.id.text
        if name in clips:
            rows.append(
                InventoryRow(
                    unit=name, container="", state=UnitState.CLIP, split=splits[name], source_digest=clips[name]
                )
            )
        elif name not in refusals:
            rows.append(
                InventoryRow(unit=name, container=row.container, state=UnitState.PENDING, source_digest=row.digest)
            )
    return rows


def run_refusals(folders: Sequence[Path]) -> list[dict[str, object]]:
    """Quarantine lines of the stages of a run, without stage fingerprints and times: what a release keeps."""
    return [{**refusal_json(refusal), "stage": folder.name} for folder in folders for refusal in quarantine_of(folder)]


def _refused_row(refusal: Refusal) -> InventoryRow:
    return InventoryRow(
        unit=refusal.unit, container=refusal.source, state=UnitState.REFUSED, reason=str(refusal.reason)
    )
