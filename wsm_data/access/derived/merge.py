"""Two releases as one: the clips of both, byte for byte, in new shards, as if they had been packed together."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from wsm_data.access.derived.materialise import moved_index
from wsm_data.access.release import Release
from wsm_data.errors import ConfigError
from wsm_data.shards.assemble import ReleaseContent, ReleaseFacts, begin_release, require_shards, write_release_files
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.manifest import ReleaseManifest
from wsm_data.shards.names import TRAIN_SPLIT
from wsm_data.shards.shard_layout import PlacedClip, ShardLayout, lay_out_shards
from wsm_data.shards.statistics import LatentSums, clip_sums, latent_statistics, merge_sums
from wsm_data.shards.writer import write_blocks

_SHOWN = 3


def merge_releases(releases: Sequence[Release], folder: Path, name: str, shard_bytes: int) -> ReleaseManifest:
    """Write the clips of several releases as a new one; dataset.json last, with the digest of each that went in.

    The statistics of the latents are counted anew, over the training clips of all. Splits stay as they are.

    Args:
        releases: what is merged.
        folder: where the new one goes.
        name: its name.
        shard_bytes: shards are filled up to this size.

    Raises:
        ConfigError: codec, depth range or image size differ, or a unit or the content of a clip is in two of them.
        IntegrityError: names the shard and the clip that are damaged.
    """
    _require_alike(releases)
    _require_apart(releases)
    of_key = {key: release for release in releases for key in release.index.texts("key")}
    index = IndexTable(pa.concat_tables([one.index.columns(SCHEMA.names) for one in releases]).unify_dictionaries())
    columns = index.columns(["key", "split", "clip_size"]).to_pydict()
    placed = zip(columns["key"], columns["split"], columns["clip_size"], strict=True)
    layouts = lay_out_shards(
        (PlacedClip(key=key, split=split, size_bytes=size) for key, split, size in placed), shard_bytes=shard_bytes
    )
    begin_release(folder)
    shards = [
        write_blocks(folder / layout.name, layout, lambda clip: [of_key[clip.key].read_clip_bytes(clip.key)])
        for layout in layouts
    ]
    require_shards(folder, layouts, shards)
    rgb, depth = _sums(layouts, of_key)
    content = ReleaseContent(
        table=moved_index(index, layouts),
        shards=shards,
        rgb_statistics=latent_statistics(rgb),
        depth_statistics=latent_statistics(depth),
    )
    inventory = [row for release in releases for row in release.inventory]
    refusals = [line for release in releases for line in release.quarantine]
    return write_release_files(folder, _facts(releases, name), content, inventory, refusals)


def _require_alike(releases: Sequence[Release]) -> None:
    first = releases[0].manifest
    for other in (release.manifest for release in releases[1:]):
        for what in ("codec", "depth_range", "encoded_width_px", "encoded_height_px"):
            if getattr(first, what) != getattr(other, what):
                raise ConfigError(
                    f"releases must have the same {what} to be merged, found {getattr(first, what)} in {first.name} "
                    f"and {getattr(other, what)} in {other.name}; encode one of them again"
                )


def _require_apart(releases: Sequence[Release]) -> None:
    """No unit may stand in two releases, nor the content of a clip: it could be trained and tested on."""
    units = Counter(row.unit for release in releases for row in release.inventory)
    contents = Counter(text for release in releases for text in release.index.texts("source_digest"))
    for what, counts in (("unit", units), ("content", contents)):
        if twice := sorted(one for one, count in counts.items() if count > 1):
            raise ConfigError(
                f"releases must have no {what} in common to be merged, found {len(twice)}, such as "
                f"{', '.join(twice[:_SHOWN])}; leave the trajectories out of one of them"
            )


def _sums(layouts: Sequence[ShardLayout], of_key: Mapping[str, Release]) -> tuple[LatentSums | None, LatentSums | None]:
    """Sums of colour and depth latents of the training clips, in the order in which packing adds them up."""
    rgb: LatentSums | None = None
    depth: LatentSums | None = None
    for layout in (one for one in layouts if one.split == TRAIN_SPLIT):
        sums = [clip_sums(of_key[clip.key].read_clip(clip.key)) for clip in layout.clips]
        rgb = merge_sums(([] if rgb is None else [rgb]) + [one for one, _ in sums])
        of_depth = [one for _, one in sums if one is not None]
        depth = merge_sums(([] if depth is None else [depth]) + of_depth)
    return rgb, depth


def _facts(releases: Sequence[Release], name: str) -> ReleaseFacts:
    first = releases[0].manifest
    fingerprints: dict[str, str] = {}
    licences: dict[str, str] = {}
    for number, release in enumerate(releases, start=1):
        own = {"release": release.digest, **release.manifest.fingerprints}
        fingerprints |= {f"merged.{number}.{stage}": digest for stage, digest in own.items()}
        licences |= release.manifest.licences
    return ReleaseFacts(
        name=name,
        codec=first.codec,
        depth_range=first.depth_range,
        encoded_width_px=first.encoded_width_px,
        encoded_height_px=first.encoded_height_px,
        fingerprints=fingerprints,
        licences=licences,
        partial=any(release.manifest.partial for release in releases),
    )
