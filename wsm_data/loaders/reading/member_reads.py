"""Whole members of a clip with their headers, in one stretch; for those that need more of a clip than a batch has."""

from collections.abc import Sequence
from dataclasses import replace

from wsm_data.access.shard_reader import ShardReader, Span
from wsm_data.errors import IntegrityError
from wsm_data.loaders.reading.clip_reads import MAX_READS
from wsm_data.shards.clip_bytes import check_members
from wsm_data.shards.index_row import IndexRow
from wsm_data.shards.members import Member, header_bytes


def read_members(
    reader: ShardReader, row: IndexRow, names: Sequence[str], *, checked: bool
) -> tuple[memoryview, tuple[Member, ...]]:
    """Read the stretch of the shard from the first to the last of some members.

    Args:
        reader: of the release's shards.
        row: the clip.
        names: names of the members, in stored order, none between them left out.
        checked: compare headers and checksums; what a store or a cache may have damaged on the way is read again.

    Returns:
        The bytes, and the members with offsets into them.

    Raises:
        IntegrityError: the shard is missing or ends too early, or its bytes are not those that the index vouches for;
            names shard and clip.
    """
    span = span_of_members(row, names)
    first = span.offset - row.clip_offset
    members = tuple(_moved(member, first) for member in row.members if member.name in names)
    data = memoryview(bytearray(span.size))
    for reads in range(1, MAX_READS + 1):
        reader.read_into(row.shard, span.offset, [data])
        try:
            if checked:
                _check(data, members, row)
            break
        except IntegrityError:
            if reads == MAX_READS or not reader.forget(row.shard):
                raise
    return data, members


def span_of_members(row: IndexRow, names: Sequence[str]) -> Span:
    """The stretch that `read_members` reads, so that it can be announced."""
    members = [member for member in row.members if member.name in names]
    first, end = members[0].header_offset, members[-1].end_offset
    return Span(row.shard, row.clip_offset + first, end - first)


def _moved(member: Member, offset: int) -> Member:
    places = {name: getattr(member, name) - offset for name in ("header_offset", "data_offset", "array_offset")}
    return replace(member, **places)


def _check(data: memoryview, members: Sequence[Member], row: IndexRow) -> None:
    where = f"{row.shard}, clip {row.key}"
    for member in members:
        if data[member.header_offset : member.array_offset] != header_bytes(row.key, member):
            raise IntegrityError(
                f"{where}: the header of {member.file_name} is not that of this clip; fetch the shard again, or run "
                "`wsm verify` for the extent of the damage"
            )
    check_members(data, members, where)
