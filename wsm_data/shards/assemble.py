"""The last step of packing: index, inventory, quarantine, and at the very end the manifest."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pyarrow as pa

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import remove_temporaries, write_bytes
from wsm_data.files.digest import sha256_file
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.depth import DepthRange
from wsm_data.shards.fragment import FragmentInfo
from wsm_data.shards.index.row import SCHEMA, IndexRow, index_row
from wsm_data.shards.index.table import IndexTable, index_table, write_index
from wsm_data.shards.inventory import InventoryRow, UnitState, count_reasons, write_inventory, write_quarantine
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo, manifest_bytes, withdraw_manifest
from wsm_data.shards.names import (
    INDEX_NAME,
    INVENTORY_NAME,
    MANIFEST_NAME,
    QUARANTINE_NAME,
    TRAIN_SPLIT,
    is_shard_name,
)
from wsm_data.shards.shard_layout import ShardLayout
from wsm_data.shards.statistics import LatentStatistics, LatentSums, latent_statistics, merge_sums


@dataclass(frozen=True, kw_only=True)
class ReleaseFacts:
    """What a release says of itself that cannot be counted from its clips; fields as in `ReleaseManifest`."""

    name: str
    codec: CodecInfo
    depth_range: DepthRange
    encoded_width_px: int
    encoded_height_px: int
    fingerprints: Mapping[str, str] = field(default_factory=dict)
    licences: Mapping[str, str] = field(default_factory=dict)
    codec_quality: Mapping[str, object] = field(default_factory=dict)
    parent: str | None = None
    partial: bool = False


def begin_release(folder: Path) -> None:
    """Withdraw the manifest and clear away what killed writers left; call it while nobody writes a shard."""
    withdraw_manifest(folder)
    if folder.exists():
        remove_temporaries(folder)


def finish_release(
    folder: Path,
    facts: ReleaseFacts,
    *,
    layouts: Sequence[ShardLayout],
    shards: Sequence[ShardInfo],
    read_info: Callable[[str], FragmentInfo],
    inventory: Sequence[InventoryRow],
    refusals: Iterable[Mapping[str, object]],
) -> ReleaseManifest:
    """Write everything beside the shards, remove shards of earlier layouts, and write dataset.json last.

    Args:
        folder: the release, with all its shards written.
        facts: what cannot be counted.
        layouts: what the shards contain.
        shards: what `write_shard` returned for each layout, in the same order.
        read_info: sidecar of a fragment by the key of its clip; called once for each, in the order of the layouts.
        inventory: every unit that went in.
        refusals: lines of the stages' quarantine files.

    Raises:
        ConfigError: a clip was made with another codec, depth range or image size than the release states.
        IntegrityError: a shard is missing, or has not the size its layout says.
    """
    begin_release(folder)
    require_shards(folder, layouts, shards)
    table, rgb, depth = _collect(facts, layouts, read_info)
    content = ReleaseContent(table=table, shards=shards, rgb_statistics=rgb, depth_statistics=depth)
    return write_release_files(folder, facts, content, inventory, refusals)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReleaseContent:
    """What was counted in the clips of a release.

    Attributes:
        table: columns of the index.
        shards: the shards, by name.
        rgb_statistics: by which colour latents are standardised.
        depth_statistics: by which depth latents are standardised.
    """

    table: pa.Table
    shards: Sequence[ShardInfo]
    rgb_statistics: LatentStatistics
    depth_statistics: LatentStatistics


def write_release_files(
    folder: Path,
    facts: ReleaseFacts,
    content: ReleaseContent,
    inventory: Sequence[InventoryRow],
    refusals: Iterable[Mapping[str, object]],
) -> ReleaseManifest:
    """Write everything beside the shards of a begun release, remove other shards, and write dataset.json last."""
    write_index(folder / INDEX_NAME, content.table)
    write_inventory(folder / INVENTORY_NAME, inventory)
    write_quarantine(folder / QUARANTINE_NAME, refusals)
    manifest = _manifest(folder, facts, content, inventory)
    _remove_other_shards(folder, {shard.name for shard in content.shards})
    write_bytes(folder / MANIFEST_NAME, manifest_bytes(manifest))
    return manifest


def require_shards(folder: Path, layouts: Sequence[ShardLayout], shards: Sequence[ShardInfo]) -> None:
    """Check that the shards of a release are those that were laid out.

    Raises:
        IntegrityError: a shard is missing, or has not the size its layout says.
    """
    for layout, shard in zip(layouts, shards, strict=True):
        path = folder / layout.name
        found = path.stat().st_size if path.exists() else None
        if not (
            shard.name == layout.name and shard.clips == len(layout.clips) and shard.bytes == layout.size_bytes == found
        ):
            raise IntegrityError(
                f"{path} must be the shard of {len(layout.clips)} clips and {layout.size_bytes} bytes, but was "
                f"written as {shard.name} of {shard.clips} clips and {shard.bytes} bytes, now {found}; pack again"
            )


def _collect(
    facts: ReleaseFacts, layouts: Sequence[ShardLayout], read_info: Callable[[str], FragmentInfo]
) -> tuple[pa.Table, LatentStatistics, LatentStatistics]:
    """One pass over the sidecars: index and statistics, without keeping the sidecars."""
    tables = [SCHEMA.empty_table()]
    rgb: LatentSums | None = None
    depth: LatentSums | None = None
    for layout in layouts:
        infos = [_require_same(facts, read_info(clip.key)) for clip in layout.clips]
        tables.append(index_table(_rows(layout, infos)))
        if layout.split == TRAIN_SPLIT:
            rgb = merge_sums(([] if rgb is None else [rgb]) + [info.rgb_sums for info in infos])
            of_depth = [info.depth_sums for info in infos if info.depth_sums is not None]
            depth = merge_sums(([] if depth is None else [depth]) + of_depth)
    table = pa.concat_tables(tables).unify_dictionaries()
    return table, latent_statistics(rgb), latent_statistics(depth)


def _rows(layout: ShardLayout, infos: Iterable[FragmentInfo]) -> Iterator[IndexRow]:
    offset = 0
    for position, info in enumerate(infos):
        yield index_row(info, split=layout.split, shard=layout.name, position=position, clip_offset=offset)
        offset += info.size_bytes


def _require_same(facts: ReleaseFacts, info: FragmentInfo) -> FragmentInfo:
    meta = info.meta
    stated = (facts.codec.digest, facts.depth_range, facts.encoded_width_px, facts.encoded_height_px)
    found = (meta.codec_digest, meta.depth_range, meta.intrinsics.width, meta.intrinsics.height)
    if found != stated:
        raise ConfigError(
            f"all clips of a release must share codec digest, depth range and image size; the release states {stated}, "
            f"clip {meta.key} has {found}; encode it again with the settings of the release"
        )
    return info


def _manifest(
    folder: Path, facts: ReleaseFacts, content: ReleaseContent, inventory: Sequence[InventoryRow]
) -> ReleaseManifest:
    index = IndexTable(content.table)
    return ReleaseManifest(
        name=facts.name,
        clips=len(index),
        frames=int(index.numbers("frames").sum()),
        latents=int(index.numbers("latents").sum()),
        clips_by_split=index.counts("split"),
        clips_by_group=index.counts("group"),
        shards=tuple(content.shards),
        index_sha256=sha256_file(folder / INDEX_NAME),
        inventory_sha256=sha256_file(folder / INVENTORY_NAME),
        quarantine_sha256=sha256_file(folder / QUARANTINE_NAME),
        codec=facts.codec,
        rgb_statistics=content.rgb_statistics,
        depth_statistics=content.depth_statistics,
        depth_range=facts.depth_range,
        encoded_width_px=facts.encoded_width_px,
        encoded_height_px=facts.encoded_height_px,
        fingerprints=facts.fingerprints,
        licences=facts.licences,
        drops=count_reasons(inventory),
        pending=sum(row.state == UnitState.PENDING for row in inventory),
        codec_quality=facts.codec_quality,
        parent=facts.parent,
        partial=facts.partial,
    )


def _remove_other_shards(folder: Path, wanted: set[str]) -> None:
    for path in sorted(folder.iterdir()):
        if is_shard_name(path.name) and path.name not in wanted:
            path.unlink()
