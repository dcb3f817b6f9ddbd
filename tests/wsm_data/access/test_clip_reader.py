import numpy as np
import pytest

from wsm_data.access.clip_reader import read_members
from wsm_data.access.local_shards import LocalShards
from wsm_data.access.release import open_release
from wsm_data.errors import IntegrityError
from wsm_data.schema.clip import MEMBERS
from wsm_data.schema.clip_meta import parse_meta
from wsm_data.shards.clip_bytes import content_of
from wsm_data.shards.members import MEMBER_NAMES, STORED_DTYPES


@pytest.fixture
def row(tiny):
    return open_release(str(tiny.folder)).index.row_at(1)


@pytest.fixture
def shards(tiny):
    reader = LocalShards(str(tiny.folder))
    yield reader
    reader.close()


@pytest.mark.parametrize("names", [MEMBER_NAMES, MEMBER_NAMES[4:], MEMBER_NAMES[:1], MEMBER_NAMES[-1:]], ids=len)
@pytest.mark.parametrize("checked", [True, False])
def test_members_are_found_in_what_was_read(tiny, shards, row, names, checked):
    [clip] = [clip for clip in tiny.clips if clip.meta.key == row.key]
    data, members = read_members(shards, row, names, checked=checked)
    assert tuple(member.name for member in members) == names
    assert len(data) == members[-1].end_offset
    for member in members:
        content = content_of(data, member)
        if member.name in MEMBERS:
            array = np.frombuffer(content, STORED_DTYPES[member.name]).reshape(member.shape)
            np.testing.assert_array_equal(array, getattr(clip, member.name))
        else:
            assert parse_meta(content) == clip.meta


def spoil(tiny, row, offset):
    path = tiny.folder / row.shard
    data = bytearray(path.read_bytes())
    data[row.clip_offset + offset] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize("name", MEMBER_NAMES)
def test_damage_is_named_and_nothing_outside_is_looked_at(tiny, shards, row, name):
    [member] = [member for member in row.members if member.name == name]
    spoil(tiny, row, member.array_offset)
    where = rf"{row.shard}, clip {row.key}: the checksum of {member.file_name} must be"
    with pytest.raises(IntegrityError, match=where):
        read_members(shards, row, MEMBER_NAMES, checked=True)
    others = MEMBER_NAMES[:4] if MEMBER_NAMES.index(name) >= 4 else MEMBER_NAMES[4:]
    read_members(shards, row, others, checked=True)
    read_members(shards, row, MEMBER_NAMES, checked=False)


def test_a_damaged_header_is_named(tiny, shards, row):
    [member] = [member for member in row.members if member.name == "poses"]
    spoil(tiny, row, member.data_offset + 20)
    with pytest.raises(
        IntegrityError,
        match=rf"clip {row.key}: the header of poses\.npy, or the padding before it, is not that",
    ):
        read_members(shards, row, MEMBER_NAMES, checked=True)


class DamagedOnTheWay:
    """A store whose first answers are spoilt."""

    def __init__(self, shards, spoilt):
        self.shards, self.spoilt, self.reads = shards, spoilt, 0

    def read_into(self, shard, offset, buffers):
        self.reads += 1
        self.shards.read_into(shard, offset, buffers)
        if self.reads <= self.spoilt:
            buffers[0][-2000] ^= 1

    def forget(self, shard):
        self.forgotten = shard


def test_what_was_damaged_on_the_way_is_read_again(shards, row):
    reader = DamagedOnTheWay(shards, 2)
    data, _ = read_members(reader, row, MEMBER_NAMES, checked=True)
    assert (reader.reads, reader.forgotten) == (3, row.shard)
    assert data == read_members(shards, row, MEMBER_NAMES, checked=True)[0]


def test_a_store_that_damages_everything_is_not_asked_for_ever(shards, row):
    reader = DamagedOnTheWay(shards, 99)
    with pytest.raises(IntegrityError, match=row.key):
        read_members(reader, row, MEMBER_NAMES, checked=True)
    assert reader.reads == 3
