"""Whatever went in came out once: the inventory against the index and the quarantine, and the counts of all three."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import inf, isfinite

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.inventory import InventoryRow, UnitState, count_reasons
from wsm_data.shards.manifest import ReleaseManifest
from wsm_data.shards.names import TRAIN_SPLIT
from wsm_data.shards.statistics import STD_FLOOR


def check_conservation(
    manifest: ReleaseManifest,
    index: IndexTable,
    inventory: Sequence[InventoryRow],
    quarantine: Sequence[Mapping[str, object]],
) -> Iterator[Finding]:
    """Find units that came out nowhere, twice, or out of nothing.

    A refusal as `episode.duplicate` is of one more trajectory under an id. Another of that id stands in the inventory
    for itself, but for two in one container, of which neither could be kept.
    """
    own = [row for row in inventory if row.reason != Reason.EPISODE_DUPLICATE]
    yield from _once(own)
    yield from _clips_in_their_place(index, [row for row in own if row.state == UnitState.CLIP])
    yield from _refusals_written_down(inventory, quarantine)
    yield from _nothing_pending(manifest, inventory)


def check_counts(manifest: ReleaseManifest, index: IndexTable, inventory: Sequence[InventoryRow]) -> Iterator[Finding]:
    """Find numbers in the manifest that are not those of the index and the inventory."""
    pairs = {
        "clips": (manifest.clips, len(index)),
        "frames": (manifest.frames, int(index.numbers("frames").sum())),
        "latents": (manifest.latents, int(index.numbers("latents").sum())),
        "clips_by_split": (dict(manifest.clips_by_split), index.counts("split")),
        "clips_by_group": (dict(manifest.clips_by_group), index.counts("group")),
        "clips by shard": ({shard.name: shard.clips for shard in manifest.shards}, index.counts("shard")),
        "drops": (dict(manifest.drops), count_reasons(inventory)),
        "pending": (manifest.pending, sum(row.state == UnitState.PENDING for row in inventory)),
    }
    for name, (stated, found) in pairs.items():
        if stated != found:
            message = f"{name} must be {stated} as in dataset.json, found {found}; restore the files or pack again"
            yield Finding(kind=FindingKind.COUNT, message=message)
    yield from _statistics_of_the_training_split(manifest, index)


def _statistics_of_the_training_split(manifest: ReleaseManifest, index: IndexTable) -> Iterator[Finding]:
    """Latents are divided by these numbers: they must be of the values of the index at least, and can be divided by.

    A release that was copied out of another has the other's statistics, which are of more values.
    """
    codes, splits = index.codes("split")
    names = ("frames", "padded_frames", "latent_height", "latent_width")
    frames, padded, height, width = (index.numbers(name).astype(np.int64) for name in names)
    real = 1 + (frames - 1) // TEMPORAL_RATIO - padded // TEMPORAL_RATIO
    trained = codes == splits.index(TRAIN_SPLIT) if TRAIN_SPLIT in splits else np.zeros(len(codes), bool)
    values = np.where(trained, real * height * width, 0)
    of_depth = values[index.numbers("depth_latent_size") > 0]
    for name, found, count in (
        ("rgb", manifest.rgb_statistics, int(values.sum())),
        ("depth", manifest.depth_statistics, int(of_depth.sum())),
    ):
        channels = manifest.codec.channels if found.count else 0
        whole = len(found.mean) == len(found.std) == channels
        if (
            found.count < count
            or not whole
            or not all(map(isfinite, found.mean))
            or not all(STD_FLOOR <= std < inf for std in found.std)
        ):
            message = (
                f"{name}_statistics must be finite, of {channels} channels and at least {count} values, "
                f"and each deviation at least {STD_FLOOR}, found {len(found.mean)} means, {len(found.std)} deviations, "
                f"{found.count} values, the least deviation {min(found.std, default=0)}; restore dataset.json or pack "
                "again"
            )
            yield Finding(kind=FindingKind.COUNT, message=message)


def _once(own: Sequence[InventoryRow]) -> Iterator[Finding]:
    for unit, times in sorted(Counter(row.unit for row in own).items()):
        if times > 1:
            states = sorted(str(row.state) for row in own if row.unit == unit)
            yield _unit(FindingKind.UNIT_TWICE, unit, f"must stand in the inventory once, found as {', '.join(states)}")


def _clips_in_their_place(index: IndexTable, clips: Sequence[InventoryRow]) -> Iterator[Finding]:
    columns = ("key", "split", "shard", "source_digest")
    rows = sorted(zip(*(index.texts(name) for name in columns), strict=True))
    stored = {key: (split, shard, digest) for key, split, shard, digest in rows}
    for key, times in sorted(Counter(key for key, *_ in rows).items()):
        if times > 1:
            shards = ", ".join(shard for other, _, shard, _ in rows if other == key)
            yield _unit(FindingKind.UNIT_TWICE, key, f"must be one clip, the index has it {times} times, in {shards}")
    wanted = {EpisodeId.parse(row.unit).key: row for row in clips}
    for key in sorted(wanted.keys() - stored.keys()):
        message = "went in and is listed as a clip, but the index has no row for it"
        yield _unit(FindingKind.UNIT_LOST, key, message)
    for key in sorted(stored.keys() - wanted.keys()):
        message = "is in the index, but no clip in the inventory"
        yield _unit(FindingKind.UNIT_UNKNOWN, key, message, shard=stored[key][1])
    for key in sorted(wanted.keys() & stored.keys()):
        row, (split, shard, digest) = wanted[key], stored[key]
        if (row.split, row.source_digest) != (split, digest):
            message = (
                f"went in as {row.split} with source digest {row.source_digest}, the index has {split} with {digest}"
            )
            yield _unit(FindingKind.CLIP_MISMATCH, key, message, shard=shard)


def _refusals_written_down(
    inventory: Sequence[InventoryRow], quarantine: Sequence[Mapping[str, object]]
) -> Iterator[Finding]:
    refused = Counter((row.unit, row.reason) for row in inventory if row.state == UnitState.REFUSED)
    written = Counter((str(line["unit"]), str(line["reason"])) for line in quarantine)
    clips = {row.unit for row in inventory if row.state == UnitState.CLIP}
    for unit, reason in sorted((refused - written).elements()):
        yield _unit(FindingKind.UNIT_LOST, unit, f"was refused as {reason}, but quarantine.jsonl has no line for that")
    for unit, reason in sorted((written - refused).elements()):
        if unit in clips:
            message = f"must be a clip or refused, but is a clip and in quarantine.jsonl as {reason}"
            yield _unit(FindingKind.UNIT_TWICE, unit, message)
        else:
            message = f"is in quarantine.jsonl as {reason}, but not in the inventory with that"
            yield _unit(FindingKind.UNIT_UNKNOWN, unit, message)


def _nothing_pending(manifest: ReleaseManifest, inventory: Sequence[InventoryRow]) -> Iterator[Finding]:
    for row in inventory:
        if row.state == UnitState.PENDING and not manifest.partial:
            message = "went in, and is neither a clip nor refused, though the release is not a partial one"
            yield _unit(FindingKind.UNIT_LOST, row.unit, message)


def _unit(kind: FindingKind, unit: str, message: str, shard: str | None = None) -> Finding:
    return Finding(kind=kind, shard=shard, clip=unit, message=f"{unit} {message}; pack again from the same stages")
