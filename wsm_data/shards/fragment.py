"""A clip written once, by `encode`: its share of a shard, and a sidecar that vouches for it."""

import json
from dataclasses import dataclass
from pathlib import Path

from wsm_data.errors import IntegrityError
from wsm_data.files.atomic import write_bytes, write_text
from wsm_data.files.digest import xxh3_128
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.clip import Clip
from wsm_data.schema.clip_meta import ClipMeta
from wsm_data.shards.clip_bytes import encode_clip
from wsm_data.shards.members import Member
from wsm_data.shards.statistics import LatentSums, clip_sums

FRAGMENT_SUFFIX = ".clip"
SIDECAR_SUFFIX = ".json"
FRAGMENT_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class FragmentInfo:
    """What the sidecar says of a fragment.

    Attributes:
        meta: the clip's own meta data.
        size_bytes: size of the fragment, a multiple of 512.
        digest: xxh3_128 of the fragment, in hexadecimal.
        members: table of the members.
        rgb_sums: sums of the colour latents, padding left out.
        depth_sums: sums of the depth latents, padding left out; None where the clip has none.
    """

    meta: ClipMeta
    size_bytes: int
    digest: str
    members: tuple[Member, ...]
    rgb_sums: LatentSums
    depth_sums: LatentSums | None

    @property
    def key(self) -> str:
        """Key of the clip."""
        return self.meta.key


@dataclass(frozen=True, kw_only=True)
class Fragment:
    """The bytes of a clip in a tar, with what its sidecar will say.

    Attributes:
        data: tar headers, members and padding; no end of archive.
        info: the sidecar.
    """

    data: bytes
    info: FragmentInfo


def build_fragment(clip: Clip) -> Fragment:
    """Serialise a clip; equal clips give equal bytes.

    Raises:
        DataError: `episode.unstorable_name`, the key or the names in it cannot be stored.
        ValueError: the key of the meta data is not the key of its id.
    """
    data, members = encode_clip(clip)
    rgb_sums, depth_sums = clip_sums(clip)
    info = FragmentInfo(
        meta=clip.meta,
        size_bytes=len(data),
        digest=xxh3_128(data),
        members=members,
        rgb_sums=rgb_sums,
        depth_sums=depth_sums,
    )
    return Fragment(data=data, info=info)


def fragment_path(folder: Path, key: str) -> Path:
    """Where the fragment of a clip stands below the folder of the encode stage."""
    return folder / f"{key}{FRAGMENT_SUFFIX}"


def write_fragment(folder: Path, fragment: Fragment) -> Path:
    """Write a fragment and then its sidecar, each atomically; a fragment with a sidecar is complete.

    Returns:
        Path of the fragment.
    """
    path = fragment_path(folder, fragment.info.key)
    sidecar = path.with_suffix(SIDECAR_SUFFIX)
    sidecar.unlink(missing_ok=True)  # an old sidecar must not vouch for new bytes, should this be killed between
    write_bytes(path, fragment.data)
    write_text(sidecar, canonical_json({"fragment_version": FRAGMENT_VERSION, **to_json(fragment.info)}) + "\n")
    return path


def read_fragment_info(path: Path) -> FragmentInfo:
    """Read the sidecar of the fragment at `path`.

    Raises:
        IntegrityError: there is no sidecar, or it is not one of this version.
    """
    sidecar = path.with_suffix(SIDECAR_SUFFIX)
    try:
        record = dict(json.loads(sidecar.read_bytes()))
        if (version := record.pop("fragment_version", None)) != FRAGMENT_VERSION:
            raise ValueError(f"fragment_version must be {FRAGMENT_VERSION}, found {version!r}")
        return from_json(FragmentInfo, record)
    except FileNotFoundError as error:
        raise IntegrityError(f"{path} has no sidecar {sidecar.name}, so it is unfinished; encode it again") from error
    except (ValueError, TypeError) as error:
        raise IntegrityError(f"{sidecar} must be the sidecar of a fragment, but: {error}; encode it again") from error
