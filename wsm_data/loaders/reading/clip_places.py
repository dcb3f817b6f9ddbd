"""Where clips stand in their shards, as far as batches need it: columns of the index, looked up for a batch at once."""

from dataclasses import dataclass
from operator import add, sub

import numpy as np

from wsm_data.access.shard_reader import Span
from wsm_data.loaders.sources.clips import Sources
from wsm_data.schema.clip import DEPTH_MEMBERS
from wsm_data.schema.sequence import frames_of

READ_MEMBERS = ("rgb_latent", "depth_latent", "depth_valid", "poses")
"""Members that batches are made of, in stored order."""

RGB_MEMBERS = tuple(name for name in READ_MEMBERS if name not in DEPTH_MEMBERS)
"""Those of batches without depth."""

_SINGLE = ("key", "shard", "latents", "padded_frames", "clip_offset")


@dataclass(frozen=True, kw_only=True, slots=True)
class ClipPlace:
    """Where a clip stands, as far as batches need it.

    Attributes:
        source: number of the source.
        number: number of the clip in the source's table.
        key: key of the clip.
        shard: file name of its shard.
        latents: F, latent frames of the whole clip.
        padded_frames: still frames at its end.
        clip_offset: first byte of the clip in the shard.
        members: names of the members that are read, in stored order.
        offsets: first byte of each of them in the shard.
        sizes: bytes of each.
        checksums: xxh3_64 of each.
    """

    source: int
    number: int
    key: str
    shard: str
    latents: int
    padded_frames: int
    clip_offset: int
    members: tuple[str, ...]
    offsets: tuple[int, ...]
    sizes: tuple[int, ...]
    checksums: tuple[int, ...]

    @property
    def frames(self) -> int:
        """T, raw frames of the whole clip."""
        return frames_of(self.latents)

    @property
    def where(self) -> str:
        """Shard and clip, for messages."""
        return f"{self.shard}, clip {self.key}"

    @property
    def gaps(self) -> tuple[int, ...]:
        """Bytes in front of each member: padding of the one before and headers, and members that are not read."""
        ends = (self.clip_offset, *map(add, self.offsets, self.sizes))
        return tuple(map(sub, self.offsets, ends))


def clip_places(sources: Sources, refs: np.ndarray, members: tuple[str, ...] = READ_MEMBERS) -> list[ClipPlace]:
    """Places of some members of clips, in the order of their refs; int64 [N]."""
    each, in_stored = len(members), ("offset", "size", "checksum")
    wanted = (*_SINGLE, *(f"{name}_{what}" for what in in_stored for name in members))
    places: list[ClipPlace | None] = [None] * len(refs)
    for source, table in enumerate(sources.tables):
        own = np.flatnonzero((refs >= table.base) & (refs < table.base + len(table)))
        numbers = refs[own] - table.base
        if not len(own):
            continue
        columns = [values.tolist() for values in table.values(wanted, numbers)]
        single, several = columns[: len(_SINGLE)], columns[len(_SINGLE) :]
        of_members = [zip(*several[first : first + each], strict=True) for first in range(0, 3 * each, each)]
        found = zip(own.tolist(), numbers.tolist(), *single, *of_members, strict=True)
        for place, number, key, shard, latents, padded_frames, clip_offset, offsets, sizes, checksums in found:
            places[place] = ClipPlace(
                source=source,
                number=number,
                key=key,
                shard=shard,
                latents=latents,
                padded_frames=padded_frames,
                clip_offset=clip_offset,
                members=members,
                offsets=offsets,
                sizes=sizes,
                checksums=checksums,
            )
    return [place for place in places if place is not None]


def span_of(place: ClipPlace) -> Span:
    """The stretch of the shard from the first to the last byte that a batch may need of a clip."""
    return Span(place.shard, place.clip_offset, place.offsets[-1] + place.sizes[-1] - place.clip_offset)
