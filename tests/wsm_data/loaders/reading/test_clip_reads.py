from collections.abc import Sequence

import numpy as np
import pytest

from wsm_data.access.clip_reader import MAX_READS
from wsm_data.access.local_shards import LocalShards
from wsm_data.errors import IntegrityError
from wsm_data.loaders.config import SourceConfig
from wsm_data.loaders.reading.clip_places import READ_MEMBERS, ClipPlace, clip_places, frames_of
from wsm_data.loaders.reading.clip_reads import MAX_GAP_BYTES, read_clip
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.timing import Part, Timing

LATENT_SHAPE = (48, 6, 10)


class Watched:
    """Local shards that note what is read, and may deliver a wrong byte a few times."""

    def __init__(self, folder: str, spoilt: int = 0):
        self._shards = LocalShards(folder)
        self.reads: list[int] = []
        self.spoilt, self.forgotten = spoilt, 0

    def read_into(self, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        self._shards.read_into(shard, offset, buffers)
        self.reads.append(sum(buffer.nbytes for buffer in buffers))
        if self.spoilt:
            self.spoilt -= 1
            buffers[1][0] ^= 1

    def expect(self, spans: object) -> None: ...

    def forget(self, shard: str) -> None:
        self.forgotten += 1

    def close(self) -> None:
        self._shards.close()


@pytest.fixture
def places(released) -> list[ClipPlace]:
    sources = open_sources([SourceConfig(release=str(released.folder))])
    return clip_places(sources, np.arange(sources.clips))


def _slots(place: ClipPlace, latents: int) -> dict[str, memoryview]:
    whole = dict(zip(READ_MEMBERS, place.sizes, strict=True))
    sizes = [whole[name] // place.latents * latents for name in READ_MEMBERS[:3]] + [28 * frames_of(latents)]
    return {name: memoryview(bytearray(size)) for name, size in zip(READ_MEMBERS, sizes, strict=True)}


@pytest.mark.parametrize("checked", [True, False])
def test_every_prefix_of_every_clip_is_read(released, places, checked):
    reader = Watched(str(released.folder))
    for place in places:
        clip = released.clips[place.key]
        for latents in range(1, place.latents + 1):
            slots = _slots(place, latents)
            last = read_clip(reader, place, LATENT_SHAPE, slots, checked=checked, timing=Timing())
            arrays = (clip.rgb_latent[:latents], clip.depth_latent[:latents], clip.depth_valid[:latents])
            for slot, array in zip(slots.values(), (*arrays, clip.poses[: frames_of(latents)]), strict=True):
                assert bytes(slot) == array.tobytes()
            np.testing.assert_array_equal(last, clip.poses[-1])


def test_a_whole_clip_is_one_read(released, places):
    reader = Watched(str(released.folder))
    for place in places:
        for checked in (True, False):
            slots = _slots(place, place.latents)
            read_clip(reader, place, LATENT_SHAPE, slots, checked=checked, timing=Timing())
    assert len(reader.reads) == 2 * len(places)


def test_a_prefix_that_is_not_checked_leaves_out_what_is_long(tmp_path, make_clip):
    """Of 40 latents one is taken: 230 kB of each kind of latents are not read."""
    from tiny_release import pack

    pack(tmp_path / "release", [make_clip(latents=40)], shard_bytes=10**7)
    sources = open_sources([SourceConfig(release=str(tmp_path / "release"))])
    [place] = clip_places(sources, np.arange(1))
    reader = Watched(str(tmp_path / "release"))
    wanted = _slots(place, 1)
    read_clip(reader, place, LATENT_SHAPE, wanted, checked=False, timing=Timing())
    assert len(reader.reads) == 3
    assert sum(reader.reads) < sum(slot.nbytes for slot in wanted.values()) + MAX_GAP_BYTES
    read_clip(reader, place, LATENT_SHAPE, _slots(place, 1), checked=True, timing=Timing())
    assert reader.reads[3:] == [sum(place.sizes) + sum(place.gaps)]


@pytest.mark.parametrize("spoilt", range(1, MAX_READS))
def test_bytes_that_a_store_spoilt_are_read_again(released, places, spoilt):
    reader = Watched(str(released.folder), spoilt=spoilt)
    slots = _slots(places[0], places[0].latents)
    read_clip(reader, places[0], LATENT_SHAPE, slots, checked=True, timing=Timing())
    assert bytes(slots["rgb_latent"]) == released.clips[places[0].key].rgb_latent.tobytes()
    assert (len(reader.reads), reader.forgotten) == (spoilt + 1, spoilt)


def test_bytes_that_stay_spoilt_are_refused(released, places):
    reader = Watched(str(released.folder), spoilt=99)
    with pytest.raises(IntegrityError, match=f"clip {places[0].key}: the checksum of rgb_latent.npy must be"):
        read_clip(reader, places[0], LATENT_SHAPE, _slots(places[0], 1), checked=True, timing=Timing())
    assert len(reader.reads) == MAX_READS


def test_reading_and_checking_are_measured_apart(released, places):
    timing = Timing()
    read_clip(Watched(str(released.folder)), places[0], LATENT_SHAPE, _slots(places[0], 1), checked=True, timing=timing)
    assert timing.seconds()[Part.STORE] > 0
    assert timing.seconds()[Part.CHECKSUM] > 0
