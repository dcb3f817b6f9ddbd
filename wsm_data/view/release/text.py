"""A release in words and numbers, for a terminal."""

from wsm_data.access.release import Release
from wsm_data.shards.manifest import release_digest
from wsm_data.view.drawing.text_table import aligned, bytes_text, printable
from wsm_data.view.release.counts import ReleaseCounts, count_release
from wsm_data.view.release.drop_examples import drop_examples


def describe_release(release: Release) -> str:
    """Head, groups by split, shards and drops by reason of a release, as aligned text."""
    counts = count_release(release)
    parts = [_head(release, counts), _groups(counts), _scenes(counts), _shards(release), _drops(release)]
    return printable("\n\n".join(parts))


def _head(release: Release, counts: ReleaseCounts) -> str:
    manifest = release.manifest
    rows = [
        ("release", manifest.name),
        ("digest", release_digest(manifest)),
        ("state", f"partial, {manifest.pending} units not worked on" if manifest.partial else "complete"),
        ("clips", f"{counts.clips:,}"),
        ("frames", f"{counts.frames:,}, and {counts.padded_frames:,} still frames of padding"),
        ("size", bytes_text(counts.bytes)),
        ("codec", f"{manifest.codec.name}, digest {manifest.codec.digest}"),
        ("images", f"{manifest.encoded_width_px} x {manifest.encoded_height_px} px"),
        ("depth range", f"{manifest.depth_range.min_m:g} to {manifest.depth_range.max_m:g} m"),
        *((f"licence of {name}", text) for name, text in sorted(manifest.licences.items())),
    ]
    return aligned(rows)


def _groups(counts: ReleaseCounts) -> str:
    rows = [("group", "camera", "scenes", "frames", *(f"{split} clips" for split in counts.splits))]
    for group in counts.groups:
        clips = (f"{group.clips_by_split.get(split, 0):,}" for split in counts.splits)
        rows.append((group.group, group.camera, f"{group.scenes:,}", f"{group.frames:,}", *clips))
    return aligned(rows, right=range(2, 4 + len(counts.splits)))


def _scenes(counts: ReleaseCounts) -> str:
    scenes = counts.scenes
    by_split = ", ".join(f"{split} {count:,}" for split, count in scenes.by_split.items())
    return (
        f"{scenes.total:,} physical scenes ({by_split}); {len(scenes.shared):,} of {scenes.held_out:,} held-out scenes "
        f"occur in training too, with {scenes.shared_clips:,} held-out clips"
    )


def _shards(release: Release) -> str:
    rows = [("shard", "split", "clips", "size", "sha256")]
    for shard in release.manifest.shards:
        rows.append((shard.name, shard.split, f"{shard.clips:,}", bytes_text(shard.bytes), shard.sha256[:16]))
    return aligned(rows, right=(2, 3))


def _drops(release: Release) -> str:
    drops = drop_examples(release)
    if not drops:
        return "nothing was dropped"
    rows = [("dropped for", "units", "example", "which says")]
    rows += [(drop.reason, f"{drop.units:,}", drop.unit, drop.message) for drop in drops]
    return aligned(rows, right=(1,))
