"""A clip as the bytes of its members in a tar, and back without copying the arrays."""

from collections.abc import Sequence

import numpy as np

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_64
from wsm_data.schema.clip import Clip
from wsm_data.schema.clip_meta import meta_bytes, parse_meta
from wsm_data.shards.members import META, STORED_DTYPES, Member, axes_of, header_bytes, lay_out
from wsm_data.shards.tar_format import padded, require_key


def encode_clip(clip: Clip) -> tuple[bytes, tuple[Member, ...]]:
    """Tar bytes of a clip, headers and padding included and no end of archive, with the table of its members.

    Raises:
        DataError: `episode.unstorable_name`, the key or the names in it cannot be stored.
        ValueError: the key of the meta data is not the key of its id.
    """
    key = clip.meta.key
    if key != clip.meta.id.key:
        raise ValueError(f"the key of a clip must be that of its id, {clip.meta.id.key!r}, found {key!r}")
    require_key(key, clip.meta.id.text)
    contents: dict[str, memoryview | bytes] = {name: _array_bytes(name, array) for name, array in clip.arrays().items()}
    contents[META] = meta_bytes(clip.meta)
    members = lay_out(
        key,
        axes=axes_of(clip.arrays()),
        meta_size=len(contents[META]),
        checksums={name: xxh3_64(content) for name, content in contents.items()},
    )
    return b"".join(_member_bytes(key, member, contents[member.name]) for member in members), members


def decode_clip(data: memoryview, members: Sequence[Member], where: str) -> Clip:
    """Rebuild a clip from its bytes; the arrays are read-only views of `data`.

    Args:
        data: the bytes that member offsets count from.
        members: where each member stands in `data`.
        where: shard and clip, for messages.

    Raises:
        IntegrityError: the members are not a valid clip.
    """
    try:
        arrays = {member.name: _view(data, member) for member in members if member.name != META}
        meta = next(member for member in members if member.name == META)
        return Clip(meta=parse_meta(content_of(data, meta)), **arrays)
    except (ValueError, TypeError) as error:
        raise IntegrityError(f"{where}: the members must form a valid clip, but: {error}") from error


def content_of(data: memoryview, member: Member) -> memoryview:
    """The bytes that the checksum of a member covers."""
    return data[member.array_offset : member.array_offset + member.array_size]


def _view(data: memoryview, member: Member) -> np.ndarray:
    return np.frombuffer(content_of(data, member), STORED_DTYPES[member.name]).reshape(member.shape)


def _array_bytes(name: str, array: np.ndarray) -> memoryview:
    stored = np.ascontiguousarray(array, STORED_DTYPES[name])
    return memoryview(stored).cast("B") if stored.size else memoryview(b"")


def _member_bytes(key: str, member: Member, content: memoryview | bytes) -> bytes:
    return b"".join([header_bytes(key, member), content, bytes(padded(member.data_size) - member.data_size)])
