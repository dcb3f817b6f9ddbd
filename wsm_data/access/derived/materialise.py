"""A selection as a release of its own: the chosen clips, byte for byte, in new shards.

Its latents are standardised as those of the release they were chosen from: the clips are for training a model further
that was trained on that release, and a model's inputs must not change their scale between the two.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from wsm_data.access.release import Release
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.assemble import (
    ReleaseContent,
    ReleaseFacts,
    begin_release,
    require_shards,
    write_release_files,
)
from wsm_data.shards.index.row import REPEATED_COLUMNS, SCHEMA
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.inventory import UnitState
from wsm_data.shards.manifest import ReleaseManifest, ShardInfo
from wsm_data.shards.selection import Selection
from wsm_data.shards.shard_layout import PlacedClip, ShardLayout, lay_out_shards
from wsm_data.shards.writer import write_blocks


def lay_out_selection(release: Release, selection: Selection, shard_bytes: int) -> tuple[ShardLayout, ...]:
    """The shards of a selection: its clips in the order by which releases mix scenes.

    Raises:
        IntegrityError: the selection lists a clip that the release does not have.
    """
    rows = pa.array(selection.rows_of(release.index))
    columns = release.index.columns(["key", "split", "clip_size"]).take(rows).to_pydict()
    clips = [
        PlacedClip(key=key, split=split, size_bytes=size)
        for key, split, size in zip(columns["key"], columns["split"], columns["clip_size"], strict=True)
    ]
    return lay_out_shards(clips, shard_bytes=shard_bytes)


def copy_shard(path: Path, layout: ShardLayout, release: Release) -> ShardInfo:
    """Write a shard of clips as they stand in the shards of a release; the checksum of every member is compared.

    Raises:
        IntegrityError: names the shard and the clip that are damaged.
    """
    return write_blocks(path, layout, lambda clip: [release.read_clip_bytes(clip.key)])


def finish_selection(
    folder: Path,
    release: Release,
    selection: Selection,
    *,
    layouts: Sequence[ShardLayout],
    shards: Sequence[ShardInfo],
    fingerprints: Mapping[str, str],
) -> ReleaseManifest:
    """Write everything beside the shards of a selection, dataset.json last.

    Statistics, codec, licences and names of sources are those of the release, and so is whether it is a partial one.
    What the release refused is not repeated: the inventory is that of the chosen clips.

    Args:
        folder: where the shards are.
        release: what the clips were copied from.
        selection: which clips.
        layouts: what the shards contain.
        shards: what `copy_shard` returned for each layout, in the same order.
        fingerprints: of what was done to the release, by name.

    Raises:
        IntegrityError: a shard is missing, or has not the size its layout says.
    """
    begin_release(folder)
    require_shards(folder, layouts, shards)
    parent = release.manifest
    content = ReleaseContent(
        table=moved_index(release.index, layouts),
        shards=shards,
        rgb_statistics=parent.rgb_statistics,
        depth_statistics=parent.depth_statistics,
    )
    chosen = set(selection.keys.to_pylist())
    clips = [row for row in release.inventory if row.state == UnitState.CLIP]
    inventory = [row for row in clips if EpisodeId.parse(row.unit).key in chosen]
    return write_release_files(folder, _facts(release, selection, fingerprints), content, inventory, ())


def _facts(release: Release, selection: Selection, fingerprints: Mapping[str, str]) -> ReleaseFacts:
    parent = release.manifest
    return ReleaseFacts(
        name=f"{parent.name}-{selection.name}",
        codec=parent.codec,
        depth_range=parent.depth_range,
        encoded_width_px=parent.encoded_width_px,
        encoded_height_px=parent.encoded_height_px,
        fingerprints={**parent.fingerprints, **fingerprints},
        licences=parent.licences,
        codec_quality=parent.codec_quality,
        parent=release.digest,
        partial=parent.partial,
    )


def moved_index(index: IndexTable, layouts: Sequence[ShardLayout]) -> pa.Table:
    """Rows of the parent's index in the order of the new shards, with their new places."""
    clips = [clip for layout in layouts for clip in layout.clips]
    table = index.columns(SCHEMA.names).take(pa.array(index.rows_of([clip.key for clip in clips])))
    columns = dict(zip(table.column_names, table.columns, strict=True))
    sizes = [np.array([clip.size_bytes for clip in layout.clips], np.int64) for layout in layouts]
    moved = np.concatenate([np.cumsum(one) - one for one in sizes]) - table["clip_offset"].to_numpy()
    for name in columns:
        if name.endswith("_offset"):
            columns[name] = pa.array(table[name].to_numpy() + moved)
    columns["shard"] = pa.array([layout.name for layout in layouts for _ in layout.clips])
    columns["position"] = pa.array(np.concatenate([np.arange(len(one), dtype=np.int32) for one in sizes]))
    for name in REPEATED_COLUMNS:  # values that no chosen clip has are left behind
        columns[name] = columns[name].cast(pa.string()).dictionary_encode()
    return pa.Table.from_arrays(list(columns.values()), schema=SCHEMA)
