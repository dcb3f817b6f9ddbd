"""What `verify` says of a release."""

from dataclasses import dataclass
from enum import StrEnum


class FindingKind(StrEnum):
    """What is wrong. Tests and reports speak of these codes."""

    RELEASE_UNREADABLE = "release.unreadable"  # unfinished, another schema version, or a damaged manifest
    FILE_CHANGED = "file.changed"  # index, inventory or quarantine: missing, or not what the manifest vouches for
    ATTACHED_CHANGED = "attached.changed"  # scores or a selection: damaged, or not of the clips of this release
    COUNT = "release.count"  # a number in the manifest is not what the files hold

    SHARD_MISSING = "shard.missing"
    SHARD_UNLISTED = "shard.unlisted"
    SHARD_SIZE = "shard.size"
    SHARD_CHANGED = "shard.changed"  # sha256; what exactly is damaged is said by other findings
    SHARD_END = "shard.end"  # the end of archive, or bytes after it
    SHARD_LAYOUT = "shard.layout"  # the index does not place the clips one after the other

    CLIP_LOST = "clip.lost"  # the shard ends before it
    CLIP_CUT = "clip.cut"  # the shard ends within it
    CLIP_HEADER = "clip.header"
    CLIP_PAYLOAD = "clip.payload"
    CLIP_PADDING = "clip.padding"
    CLIP_INVALID = "clip.invalid"  # whole, but not what the format asks for
    CLIP_MISMATCH = "clip.mismatch"  # its meta data disagree with index or manifest
    CLIP_CODEC = "clip.codec"
    CLIP_GOAL = "clip.goal"  # the expert does not arrive, or the distance field has another goal

    UNIT_LOST = "unit.lost"  # went in and came out nowhere
    UNIT_TWICE = "unit.twice"
    UNIT_UNKNOWN = "unit.unknown"  # came out and never went in


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that is wrong with a release.

    Attributes:
        kind: what.
        message: what must hold, what was found, and what to do; for a person.
        shard: file name of the shard, where one is concerned.
        clip: key of the clip or id of the unit, where one is concerned.
    """

    kind: FindingKind
    message: str
    shard: str | None = None
    clip: str | None = None
