"""One clip of a shard: its bytes against headers made anew and checksums, then its values against the format."""

from collections.abc import Iterator

import numpy as np

from wsm_data.checks.goal_reached import ARRIVED_M
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_64
from wsm_data.schema.clip import UNREACHABLE_MM, Clip
from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN
from wsm_data.shards.clip_bytes import content_of, decode_clip
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.manifest import ReleaseManifest
from wsm_data.shards.members import Member, header_bytes


def check_clip(data: memoryview, row: IndexRow, manifest: ReleaseManifest) -> list[Finding]:
    """Everything that is wrong with a clip.

    Args:
        data: the bytes from `row.clip_offset`, `row.clip_size` of them or fewer where the shard ends.
        row: its row in the index.
        manifest: the release.
    """
    if len(data) < row.clip_size:
        return [_cut(data, row)]
    damage = [finding for member in row.members for finding in _damage(data, member, row)]
    if damage:
        return damage  # values of damaged bytes say nothing more
    try:
        clip = decode_clip(data, row.members, f"{row.shard}, clip {row.key}")
    except IntegrityError as error:
        return [_finding(FindingKind.CLIP_INVALID, row, str(error))]
    return [
        *_provenance(clip, row),
        *_encoding(clip, row, manifest),
        *_map(clip, row),
        *_arrival(clip, row),
    ]


def _cut(data: memoryview, row: IndexRow) -> Finding:
    if not len(data):
        message = f"the shard ends before the clip, which must start at byte {row.clip_offset}; fetch the shard again"
        return _finding(FindingKind.CLIP_LOST, row, message)
    member = next(member for member in row.members if len(data) < member.end_offset)
    if len(data) == member.header_offset:
        place = f"before {member.file_name}, between two members"
    elif len(data) < member.array_offset:
        place = f"inside the header of {member.file_name}"
    else:
        place = f"inside {member.file_name}"
    return _finding(
        FindingKind.CLIP_CUT,
        row,
        f"the clip must have {row.clip_size} bytes, but the shard ends {place}, after {len(data)}; fetch it again",
    )


def _damage(data: memoryview, member: Member, row: IndexRow) -> Iterator[Finding]:
    header, stored = header_bytes(row.key, member), data[member.header_offset : member.array_offset]
    if stored != header:
        place = next(i for i, (a, b) in enumerate(zip(header, stored, strict=True)) if a != b)
        at = row.clip_offset + member.header_offset + place
        kind = "tar" if place < member.data_offset - member.header_offset else "npy"
        message = f"the {kind} header of {member.file_name} must have {header[place]:#04x} at byte {at} of the shard"
        yield _finding(FindingKind.CLIP_HEADER, row, f"{message}, found {stored[place]:#04x}; fetch the shard again")
    found = xxh3_64(content_of(data, member))
    if found != member.checksum:
        message = f"the checksum of {member.file_name} must be {member.checksum}, found {found}; fetch the shard again"
        yield _finding(FindingKind.CLIP_PAYLOAD, row, message)
    if any(data[member.data_offset + member.data_size : member.end_offset]):
        message = f"the padding after {member.file_name} must be zero, found other bytes; fetch the shard again"
        yield _finding(FindingKind.CLIP_PADDING, row, message)


def _provenance(clip: Clip, row: IndexRow) -> Iterator[Finding]:
    meta = clip.meta
    pairs = {
        "key": (row.key, meta.key),
        "key of the id": (row.key, meta.id.key),
        "unit": (row.unit, meta.id.text),
        "camera": (row.camera, meta.id.camera),
        "physical_scene": (row.physical_scene, meta.id.physical_scene),
        "dataset": (row.dataset, meta.dataset),
        "source_digest": (row.source_digest, meta.source_digest),
        "padded_frames": (row.padded_frames, meta.padded_frames),
        "latent_dtype": (clip.rgb_latent.dtype.name, meta.latent_dtype),
    }
    for name, (wanted, found) in pairs.items():
        if wanted != found:
            message = f"{name} must be {wanted!r} as in the index, found {found!r} in meta.json; pack again"
            yield _finding(FindingKind.CLIP_MISMATCH, row, message)


def _encoding(clip: Clip, row: IndexRow, manifest: ReleaseManifest) -> Iterator[Finding]:
    meta, codec = clip.meta, manifest.codec
    for place, digest in (("index", row.codec_digest), ("meta.json", meta.codec_digest)):
        if digest != codec.digest:
            message = f"the codec must be {codec.name} with digest {codec.digest} as in dataset.json, found {digest}"
            yield _finding(
                FindingKind.CLIP_CODEC, row, f"{message} in {place}; codecs must not be mixed, encode it again"
            )
    size = (manifest.encoded_width_px, manifest.encoded_height_px)
    cells = (codec.channels, size[1] // codec.spatial_ratio, size[0] // codec.spatial_ratio)
    pairs = {
        "image size": (size, (meta.intrinsics.width, meta.intrinsics.height)),
        "shape of a latent": (cells, clip.rgb_latent.shape[1:]),
        "depth range": (manifest.depth_range, meta.depth_range),
    }
    for name, (wanted, found) in pairs.items():
        if wanted != found:
            message = f"the {name} must be {wanted} as in dataset.json, found {found}; encode it again"
            yield _finding(FindingKind.CLIP_MISMATCH, row, message)


def _map(clip: Clip, row: IndexRow) -> Iterator[Finding]:
    values = np.unique(clip.occupancy)
    if not np.isin(values, (FREE, OCCUPIED, UNKNOWN)).all():
        message = f"occupancy must be {FREE}, {OCCUPIED} or {UNKNOWN}, found {values.tolist()}; encode it again"
        yield _finding(FindingKind.CLIP_INVALID, row, message)
    through = int(((clip.occupancy == OCCUPIED) & (clip.geodesic_mm != UNREACHABLE_MM)).sum())
    if through:
        message = f"geodesic_mm must be {UNREACHABLE_MM} in occupied cells, found {through} others; encode it again"
        yield _finding(FindingKind.CLIP_INVALID, row, message)


def _arrival(clip: Clip, row: IndexRow) -> Iterator[Finding]:
    last, least = clip.expert_distance[-1], clip.expert_distance.min()
    if last > np.float32(ARRIVED_M) or least < 0:
        message = f"expert_distance must not be negative and end within {ARRIVED_M} m of 0, found least {least:.4f}"
        yield _finding(FindingKind.CLIP_GOAL, row, f"{message} and last {last:.4f} m; encode it again")
    if not (clip.geodesic_mm[_near_goal(clip)] == 0).any():
        goal = clip.meta.goal_world_m[:2]
        message = f"geodesic_mm must be 0 in the goal region around {goal}, found no such cell; encode it again"
        yield _finding(FindingKind.CLIP_GOAL, row, message)


def _near_goal(clip: Clip) -> np.ndarray:
    """Cells that the goal region touches: centres no farther from the goal than its radius and half a diagonal."""
    meta = clip.meta
    y, x = np.indices(clip.geodesic_mm.shape)
    dx = (x + meta.map_origin_cell[0] + 0.5) * meta.map_resolution_m - meta.goal_world_m[0]
    dy = (y + meta.map_origin_cell[1] + 0.5) * meta.map_resolution_m - meta.goal_world_m[1]
    return np.asarray(np.hypot(dx, dy) <= meta.goal_radius_m + np.sqrt(0.5) * meta.map_resolution_m)


def _finding(kind: FindingKind, row: IndexRow, message: str) -> Finding:
    return Finding(kind=kind, shard=row.shard, clip=row.key, message=message)
