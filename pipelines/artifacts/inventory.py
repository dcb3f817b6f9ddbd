"""What went into a run, unit by unit, and what became of it: the evidence that nothing was lost."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pipelines.artifacts.episode_table import read_episodes
from pipelines.running.upstream import pending_units, quarantine_of
from wsm_data.errors import Reason
from wsm_data.files.json_values import to_json
from wsm_data.schema.verdict import Refusal
from wsm_data.shards.inventory import InventoryRow, UnitState


@dataclass(frozen=True, kw_only=True)
class Account:
    """Everything that went in, once.

    Attributes:
        rows: one for every trajectory, refused container and pending container.
        quarantine: the refusals among them as a release keeps them, without times and fingerprints.
    """

    rows: tuple[InventoryRow, ...]
    quarantine: tuple[Mapping[str, object], ...]


def account_of(index: Path, encode: Path, splits: Mapping[str, str], clips: Mapping[str, str]) -> Account:
    """Draw up the account of a run.

    The container of a clip is left out: it tells the layout of the source, and a release does not depend on it. What a
    missing map cost is told by the refusals of its trajectories in `encode`.

    Args:
        index: folder of `wsm index`.
        encode: folder of `wsm encode`.
        splits: split of every accepted trajectory, by its id.
        clips: content digests of the trajectories that became clips, by id.
    """
    episodes = {row.id.text: row for row in read_episodes(index)}
    pending = {name if name not in episodes else f"{name}@{name}": name for name in pending_units(index)}
    at_index = _distinct(quarantine_of(index), {*episodes, *pending})
    at_encode = [refusal for refusal in quarantine_of(encode) if refusal.unit in episodes]
    refused = {refusal.unit for refusal in at_encode}
    rows = [InventoryRow(unit=unit, container=name, state=UnitState.PENDING) for unit, name in pending.items()]
    for name, row in episodes.items():
        if name in clips:
            state, split = UnitState.CLIP, splits[name]
            rows.append(InventoryRow(unit=name, container="", state=state, split=split, source_digest=clips[name]))
        elif name not in refused:
            state, container = UnitState.PENDING, row.container
            rows.append(InventoryRow(unit=name, container=container, state=state, source_digest=row.digest))
    rows += [_refused_row(refusal) for refusal in (*at_index, *at_encode)]
    quarantine = [{**to_json(one), "stage": "index"} for one in at_index]
    quarantine += [{**to_json(one), "stage": "encode"} for one in at_encode]
    return Account(rows=tuple(rows), quarantine=tuple(quarantine))


def _distinct(refusals: Collection[Refusal], others: Collection[str]) -> list[Refusal]:
    """Name a refused unit with its container where something else stands in the account under its id.

    The same trajectory may have been accepted, or refused, from another container, and a trajectory folder's own name
    may be the id of a trajectory. A duplicate keeps the id: its reason says that it is one more of that name.
    """
    taken = set(others)
    named = []
    for refusal in sorted(refusals, key=lambda one: (one.unit, one.source)):
        if refusal.reason is not Reason.EPISODE_DUPLICATE and refusal.unit in taken:
            refusal = replace(refusal, unit=f"{refusal.unit}@{refusal.source}")
        taken.add(refusal.unit)
        named.append(refusal)
    return named


def _refused_row(refusal: Refusal) -> InventoryRow:
    return InventoryRow(
        unit=refusal.unit, container=refusal.source, state=UnitState.REFUSED, reason=str(refusal.reason)
    )
