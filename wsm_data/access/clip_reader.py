"""Members of clips, read in one stretch and checked; what was damaged on the way is read again, for whoever reads."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from wsm_data.access.shard_reader import ShardReader, Span
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_64
from wsm_data.shards.clip_bytes import content_of
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.members import MEMBER_NAMES, Member, header_bytes

MAX_READS = 3
"""How often a clip is read whose bytes a disk, a store or a cache may have damaged on the way."""


def read_members(
    reader: ShardReader, row: IndexRow, names: Sequence[str] = MEMBER_NAMES, *, checked: bool = True
) -> tuple[memoryview, tuple[Member, ...]]:
    """Read the stretch of the shard from the first to the last of some members.

    Args:
        reader: of the release's shards.
        row: the clip.
        names: names of the members, in stored order, none between them left out; those that the clip does not have are
            passed over.
        checked: compare headers and checksums.

    Returns:
        The bytes, read-only, and the members with offsets into them.

    Raises:
        IntegrityError: the shard is missing or ends too early, or its bytes are not those that the index vouches for;
            names shard, clip and member.
    """
    span = span_of_members(row, names)
    first = span.offset - row.clip_offset
    members = tuple(_moved(member, first) for member in row.members if member.name in names)
    data = memoryview(np.empty(span.size, np.uint8))  # not filled with zeros first, as a bytearray is
    read_until_whole(
        reader,
        row.shard,
        row.key,
        read=lambda: reader.read_into(row.shard, span.offset, [data]),
        damage=lambda: _damage(data, members, row.key) if checked else None,
    )
    return data.toreadonly(), members


def read_until_whole(
    reader: ShardReader, shard: str, key: str, *, read: Callable[[], None], damage: Callable[[], str | None]
) -> None:
    """Read, and read again what was damaged, `MAX_READS` times in all.

    Args:
        reader: what `read` uses.
        shard: file name of the shard.
        key: key of the clip, for messages.
        read: reads.
        damage: what is wrong with the bytes that were read; None where nothing is.

    Raises:
        IntegrityError: the bytes stay wrong, or the shard is missing or ends too early; names shard and clip.
    """
    for _ in range(MAX_READS):
        try:
            read()
        except IntegrityError as error:
            raise IntegrityError(f"clip {key}: {error}") from error
        found = damage()
        if found is None:
            return
        reader.forget(shard)
    raise IntegrityError(
        f"{shard}, clip {key}: {found}; fetch the shard again, or run `wsm verify` for the extent of the damage"
    )


def wrong_header(name: str) -> str:
    """The damage of a header."""
    return f"the header of {name}, or the padding before it, is not that of this clip"


def wrong_checksum(name: str, wanted: str, found: str) -> str:
    """The damage of a content."""
    return f"the checksum of {name} must be {wanted}, found {found}"


def span_of_members(row: IndexRow, names: Sequence[str]) -> Span:
    """The stretch that `read_members` reads, so that it can be announced."""
    members = [member for member in row.members if member.name in names]
    first, end = members[0].header_offset, members[-1].end_offset
    return Span(row.shard, row.clip_offset + first, end - first)


def _moved(member: Member, offset: int) -> Member:
    places = {name: getattr(member, name) - offset for name in ("header_offset", "data_offset", "array_offset")}
    return replace(member, **places)


def _damage(data: memoryview, members: Sequence[Member], key: str) -> str | None:
    for member in members:
        if data[member.header_offset : member.array_offset] != header_bytes(key, member):
            return wrong_header(member.file_name)
        found = xxh3_64(content_of(data, member))
        if found != member.checksum:
            return wrong_checksum(member.file_name, member.checksum, found)
    return None
