import numpy as np
import pytest

from wsm_data.loaders.config import SourceConfig
from wsm_data.loaders.reading.clip_places import READ_MEMBERS, clip_places, frames_of, span_of
from wsm_data.loaders.sources.clips import open_sources


@pytest.fixture
def sources(released):
    config = SourceConfig(release=str(released.folder))
    return open_sources([config, config])


@pytest.mark.parametrize("refs", [[0], [3, 3, 1], [25, 26, 0, 51], []], ids=str)
def test_places_are_those_of_the_index_in_the_order_of_the_refs(sources, refs):
    places = clip_places(sources, np.array(refs, np.int64))
    assert len(places) == len(refs)
    for ref, place in zip(refs, places, strict=True):
        table, number = sources.locate(ref)
        row = table.index_row(number)
        members = {member.name: member for member in row.members}
        assert (place.source, place.number) == (sources.tables.index(table), number)
        assert (place.key, place.shard) == (row.key, row.shard)
        assert (place.latents, place.frames) == (row.latents, row.frames)
        assert (place.padded_frames, place.clip_offset) == (row.padded_frames, row.clip_offset)
        assert place.where == f"{row.shard}, clip {row.key}"
        for name, offset, size, checksum in zip(READ_MEMBERS, place.offsets, place.sizes, place.checksums, strict=True):
            assert offset == row.clip_offset + members[name].array_offset
            assert (size, f"{checksum:016x}") == (members[name].array_size, members[name].checksum)


def test_gaps_are_what_lies_between_the_members(sources):
    [place] = clip_places(sources, np.array([4]))
    at = place.clip_offset
    for gap, offset, size in zip(place.gaps, place.offsets, place.sizes, strict=True):
        at += gap
        assert at == offset
        at += size
    assert span_of(place).offset == place.clip_offset
    assert span_of(place).end == at
    assert span_of(place).shard == place.shard


def test_each_latent_after_the_first_covers_four_frames():
    assert [frames_of(latents) for latents in (1, 2, 3, 9)] == [1, 5, 9, 33]
