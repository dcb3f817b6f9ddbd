"""dataset.json: what a release is, written last and read first."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import digest_json, sha256_bytes
from wsm_data.files.json_values import from_json, to_json
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.depth import DepthRange
from wsm_data.shards.names import MANIFEST_NAME, is_shard_name
from wsm_data.shards.statistics import LatentStatistics

RELEASE_SCHEMA_VERSION = 1

MIN_CLIP_BYTES = 5 * 1024
"""What the least clip takes in a shard: five members, each with a block of header and one of content."""


@dataclass(frozen=True, kw_only=True)
class ShardInfo:
    """One shard of a release.

    Attributes:
        name: file name.
        split: split of all its clips.
        clips: number of clips.
        bytes: size of the file.
        sha256: digest of the file, in hexadecimal.
    """

    name: str
    split: str
    clips: int
    bytes: int
    sha256: str

    def __post_init__(self) -> None:
        if not is_shard_name(self.name):  # it becomes a path, of a release and of caches
            raise ValueError(f"a shard must have a name such as train-000000.tar, found {self.name!r}")
        if not 0 <= self.clips * MIN_CLIP_BYTES <= self.bytes:  # whoever reads it allocates by these numbers
            raise ValueError(f"{self.name} of {self.bytes} bytes cannot hold {self.clips} clips")


@dataclass(frozen=True, kw_only=True)
class ReleaseManifest:
    """Everything that is to be known of a release before its shards are opened.

    No time, host or path stands in it: the same clips give the same bytes anywhere.

    Attributes:
        name: name of the release.
        clips: number of clips.
        frames: raw frames of all clips, padding included.
        latents: latent frames of all clips, padding included.
        clips_by_split: clips of each split.
        clips_by_group: clips of each data set group.
        shards: the shards, by name.
        index_sha256: digest of index.parquet.
        inventory_sha256: digest of inventory.parquet.
        quarantine_sha256: digest of quarantine.jsonl.
        codec: the codec of all clips.
        rgb_statistics: of the colour latents of the training split.
        depth_statistics: of the depth latents of the training split, of those clips that have depth.
        depth_range: metric range of the log-depth normalisation of all clips.
        encoded_width_px: width of the images that were encoded, px.
        encoded_height_px: height of the images that were encoded, px.
        fingerprints: fingerprint of each stage the clips went through, by its name.
        licences: licence of each source, by the name of its data set.
        drops: refused units by reason.
        pending: units that were not worked on yet; 0 unless `partial`.
        codec_quality: measured quality of the codec.
        parent: digest of the release this one was selected from, or None.
        partial: whether only a part of the source was worked on (`--limit`, `--only`).
        schema_version: version of the release format.
    """

    name: str
    clips: int
    frames: int
    latents: int
    clips_by_split: Mapping[str, int]
    clips_by_group: Mapping[str, int]
    shards: tuple[ShardInfo, ...]
    index_sha256: str
    inventory_sha256: str
    quarantine_sha256: str
    codec: CodecInfo
    rgb_statistics: LatentStatistics
    depth_statistics: LatentStatistics
    depth_range: DepthRange
    encoded_width_px: int
    encoded_height_px: int
    fingerprints: Mapping[str, str]
    licences: Mapping[str, str]
    drops: Mapping[str, int]
    pending: int
    codec_quality: Mapping[str, object] = field(default_factory=dict)
    parent: str | None = None
    partial: bool = False
    schema_version: int = RELEASE_SCHEMA_VERSION

    @cached_property
    def shard_bytes(self) -> Mapping[str, int]:
        """Size of each shard by its name."""
        return {shard.name: shard.bytes for shard in self.shards}


def manifest_bytes(manifest: ReleaseManifest) -> bytes:
    """The one spelling of dataset.json: sorted keys, two spaces, a newline at the end.

    `content_sha256` is the digest of all the other fields in canonical JSON: a changed byte anywhere contradicts it.
    """
    record = to_json(manifest)
    record["content_sha256"] = digest_json(record)
    text = json.dumps(record, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)
    return text.encode() + b"\n"


def release_digest(manifest: ReleaseManifest) -> str:
    """Digest by which selections and models name a release: the sha256 of its dataset.json."""
    return sha256_bytes(manifest_bytes(manifest))


def parse_manifest(data: bytes, where: str) -> ReleaseManifest:
    """Inverse of `manifest_bytes`.

    Args:
        data: content of a dataset.json.
        where: its place, for messages.

    Raises:
        IntegrityError: it is not a manifest of this schema version, to the byte.
    """
    try:
        record = json.loads(data)
        version = record["schema_version"]
        if version != RELEASE_SCHEMA_VERSION:
            raise ValueError(f"schema_version must be {RELEASE_SCHEMA_VERSION}, found {version!r}; use a matching wsm")
        manifest = from_json(ReleaseManifest, {name: item for name, item in record.items() if name != "content_sha256"})
        if manifest_bytes(manifest) != data:
            raise ValueError("it was changed since it was written; restore the file")
    except (ValueError, TypeError, KeyError) as error:
        raise IntegrityError(f"{where} must be the manifest of a release, but: {error}") from error
    return manifest


def withdraw_manifest(folder: Path) -> None:
    """Remove dataset.json, so that a release that is being written, or written again, is seen as unfinished."""
    (folder / MANIFEST_NAME).unlink(missing_ok=True)
