"""One clip from its shard into memory that the caller owns: which bytes go where, and whether they are the right ones.

The members that a batch needs stand one after the other in the shard, with their headers between them. One scattered
read puts each of them where it belongs; what lies between goes into memory that nobody looks at.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import prod
from operator import add, sub

import numpy as np
import xxhash

from wsm_data.errors import IntegrityError
from wsm_data.loaders.shard_reader import ShardReader, Span
from wsm_data.loaders.source_table import Sources
from wsm_data.loaders.timing import Part, Stopwatch
from wsm_data.schema.clip import TEMPORAL_RATIO
from wsm_data.shards.members import STORED_DTYPES, array_header, shape_of
from wsm_data.shards.names import INDEX_NAME
from wsm_data.shards.tar_format import NPY_HEADER_BYTES, padded

READ_MEMBERS = ("rgb_latent", "depth_latent", "depth_valid", "poses")
"""Members that batches are made of, in stored order."""

POSE_BYTES = 7 * STORED_DTYPES["poses"].itemsize
MAX_GAP_BYTES = 1 << 16
"""What lies between two wanted stretches is read along with them up to this size; a second read costs about as much."""

MAX_READS = 3
"""How often a clip is read whose bytes a store, or a cache, may have damaged on the way."""

_UNWANTED = memoryview(bytearray(MAX_GAP_BYTES))
_NOTHING = memoryview(b"")


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
        offsets: first byte of each of `READ_MEMBERS` in the shard.
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
        """Bytes in front of each member: padding of the one before, and headers."""
        ends = (self.clip_offset, *map(add, self.offsets, self.sizes))
        return tuple(map(sub, self.offsets, ends))


def frames_of(latents: int) -> int:
    """Raw frames of so many latents."""
    return 1 + TEMPORAL_RATIO * (latents - 1)


def clip_places(sources: Sources, refs: np.ndarray) -> list[ClipPlace]:
    """Places of clips, in the order of their refs; int64 [N]."""
    places: list[ClipPlace | None] = [None] * len(refs)
    for source, table in enumerate(sources.tables):
        own = np.flatnonzero((refs >= table.base) & (refs < table.base + len(table)))
        numbers = refs[own] - table.base
        if not len(own):
            continue
        shards = table.shard_codes[numbers].tolist()
        single = [table.column(name)[numbers].tolist() for name in ("latents", "padded_frames", "clip_offset")]
        members = [
            zip(*(table.column(f"{name}_{what}")[numbers].tolist() for name in READ_MEMBERS), strict=True)
            for what in ("offset", "size", "checksum")
        ]
        columns = zip(own.tolist(), numbers.tolist(), table.keys(numbers), shards, *single, *members, strict=True)
        for place, number, key, shard, latents, padded_frames, clip_offset, offsets, sizes, checksums in columns:
            places[place] = ClipPlace(
                source=source,
                number=number,
                key=key,
                shard=table.shards[shard],
                latents=latents,
                padded_frames=padded_frames,
                clip_offset=clip_offset,
                offsets=offsets,
                sizes=sizes,
                checksums=checksums,
            )
    return [place for place in places if place is not None]


def span_of(place: ClipPlace) -> Span:
    """The stretch of the shard from the first to the last byte that a batch may need of a clip."""
    return Span(place.shard, place.clip_offset, place.offsets[-1] + place.sizes[-1] - place.clip_offset)


def read_clip(
    reader: ShardReader,
    place: ClipPlace,
    latent_shape: tuple[int, int, int],
    slots: Sequence[memoryview],
    *,
    checked: bool,
    watch: Stopwatch,
) -> np.ndarray:
    """Read a clip, or a prefix of it, into slots.

    Args:
        reader: of the release's shards.
        place: the clip.
        latent_shape: channels, height and width of a latent.
        slots: memory for the leading bytes of each of `READ_MEMBERS`, all of them or fewer.
        checked: compare headers and checksums; for this, members are read to their end.
        watch: measures the time of reading and of checking.

    Returns:
        The last pose of the whole clip; float32 [7].

    Raises:
        IntegrityError: the shard is missing or ends too early, its bytes are not those that the index vouches for, or
            the index places members where they cannot be; names shard and clip.
    """
    shapes = _shapes(place.latents, latent_shape)
    _require_sound(place, shapes)
    headers = [_memory(size) for size in place.gaps] if checked else [_NOTHING] * len(slots)
    tails = [_memory(size) for size in _tail_sizes(place, slots, checked)]
    for reads in range(1, MAX_READS + 1):
        with watch.measure(Part.STORE):
            _fill(reader, place, _pieces(place, headers, slots, tails))
        with watch.measure(Part.CHECKSUM):
            damage = next(_damage(place, shapes, headers, slots, tails), None) if checked else None
        if damage is None:
            break
        if not reader.forget(place.shard) or reads == MAX_READS:
            raise IntegrityError(f"{place.where}: {damage}; fetch the shard again, or run `wsm verify` for the extent")
    last = tails[-1] if tails[-1].nbytes else slots[-1]
    return np.frombuffer(last[-POSE_BYTES:], STORED_DTYPES["poses"])


@lru_cache(maxsize=4096)
def _shapes(latents: int, latent_shape: tuple[int, int, int]) -> tuple[tuple[int, ...], ...]:
    """Shape of each member that is read of a clip of so many latents."""
    axes = dict(zip("FChwT", (latents, *latent_shape, frames_of(latents)), strict=True))
    return tuple(shape_of(name, axes) for name in READ_MEMBERS)


@lru_cache(maxsize=4096)
def _sizes(shapes: tuple[tuple[int, ...], ...]) -> tuple[int, ...]:
    """Bytes of each member that is read."""
    return tuple(prod(shape) * STORED_DTYPES[name].itemsize for name, shape in zip(READ_MEMBERS, shapes, strict=True))


def _memory(size_bytes: int) -> memoryview:
    return memoryview(bytearray(size_bytes)) if size_bytes else _NOTHING


def _tail_sizes(place: ClipPlace, slots: Sequence[memoryview], checked: bool) -> list[int]:
    """Bytes behind each slot that are read too: all that a checksum covers, or the last pose alone."""
    rests = [size - slot.nbytes for size, slot in zip(place.sizes, slots, strict=True)]
    return rests if checked else [0, 0, 0, min(rests[-1], POSE_BYTES)]


def _pieces(
    place: ClipPlace, headers: Sequence[memoryview], slots: Sequence[memoryview], tails: Sequence[memoryview]
) -> Iterator[tuple[int, memoryview]]:
    """What is read: offset in the shard and memory for it, in the order of the offsets."""
    for offset, size, header, slot, tail in zip(place.offsets, place.sizes, headers, slots, tails, strict=True):
        yield offset - header.nbytes, header
        yield offset, slot
        yield offset + size - tail.nbytes, tail


def _fill(reader: ShardReader, place: ClipPlace, pieces: Iterable[tuple[int, memoryview]]) -> None:
    """Read pieces that stand close together at once, with what lies between them."""
    start = end = place.clip_offset
    buffers: list[memoryview] = []
    try:
        for offset, buffer in pieces:
            if not buffer.nbytes:
                continue
            if offset - end > MAX_GAP_BYTES and buffers:
                reader.read_into(place.shard, start, buffers)
                buffers = []
            if not buffers:
                start = end = offset
            elif offset > end:
                buffers.append(_UNWANTED[: offset - end])
            buffers.append(buffer)
            end = offset + buffer.nbytes
        reader.read_into(place.shard, start, buffers)
    except IntegrityError as error:
        raise IntegrityError(f"clip {place.key}: {error}") from error


def _damage(
    place: ClipPlace,
    shapes: Sequence[tuple[int, ...]],
    headers: Sequence[memoryview],
    slots: Sequence[memoryview],
    tails: Sequence[memoryview],
) -> Iterator[str]:
    """What is wrong with the bytes that were read, member by member."""
    before = 0  # bytes of the member before, in whole blocks and in part
    for name, header, shape, size in zip(READ_MEMBERS, headers, shapes, place.sizes, strict=True):
        if header != bytes(padded(before) - before) + array_header(place.key, name, shape):
            yield f"the header of {name}.npy, or the padding before it, is not that of this clip"
        before = NPY_HEADER_BYTES + size
    for name, wanted, slot, tail in zip(READ_MEMBERS, place.checksums, slots, tails, strict=True):
        found = _checksum(slot, tail)
        if found != wanted:
            yield f"the checksum of {name}.npy must be {wanted:016x}, found {found:016x}"


def _checksum(slot: memoryview, tail: memoryview) -> int:
    if not tail.nbytes:
        return xxhash.xxh3_64_intdigest(slot)
    state = xxhash.xxh3_64(slot)
    state.update(tail)
    return state.intdigest()


def _require_sound(place: ClipPlace, shapes: tuple[tuple[int, ...], ...]) -> None:
    """The index must give the members the sizes of a clip, one behind the other, with room for headers between them."""
    gaps = place.gaps
    if place.sizes != _sizes(shapes) or min(gaps) <= 0 or max(gaps) > MAX_GAP_BYTES:
        raise IntegrityError(
            f"{place.where}: {INDEX_NAME} places members where a clip of {place.latents} latents does not have them, "
            f"at {place.offsets} with {place.sizes} bytes; restore the index"
        )
