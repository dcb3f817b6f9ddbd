"""One clip from its shard into memory that the caller owns: which bytes go where, and whether they are the right ones.

The members that a batch needs stand one after the other in the shard, with their headers between them. One scattered
read puts each of them where it belongs; what lies between goes into memory that nobody looks at. Depth that nobody
asked for is passed over.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import prod
from operator import add, itemgetter

import numpy as np
import xxhash

from wsm_data.access.clip_reader import read_until_whole, wrong_checksum, wrong_header
from wsm_data.access.shard_reader import ShardReader
from wsm_data.errors import IntegrityError
from wsm_data.loaders.reading.clip_places import READ_MEMBERS, ClipPlace
from wsm_data.loaders.timing import Part, Timing
from wsm_data.schema.sequence import frames_of
from wsm_data.shards.members import STORED_DTYPES, array_header, shape_of
from wsm_data.shards.names import INDEX_NAME
from wsm_data.shards.tar_format import NPY_HEADER_BYTES, padded

POSE_BYTES = 7 * STORED_DTYPES["poses"].itemsize
MAX_GAP_BYTES = 1 << 16
"""What lies between two wanted stretches is read along with them up to this size; a second read costs about as much."""

_UNWANTED = memoryview(bytearray(MAX_GAP_BYTES))
_NOTHING = memoryview(b"")


def read_clip(
    reader: ShardReader,
    place: ClipPlace,
    latent_shape: tuple[int, int, int],
    slots: Mapping[str, memoryview],
    *,
    checked: bool,
    timing: Timing,
) -> np.ndarray:
    """Read a clip, or a prefix of it, into slots.

    Args:
        reader: of the release's shards.
        place: the clip.
        latent_shape: channels, height and width of a latent.
        slots: by name of each of the place's members, memory for its leading bytes, all of them or fewer.
        checked: compare headers and checksums; for this, members are read to their end.
        timing: adds up the time of reading and of checking.

    Returns:
        The last pose of the whole clip; float32 [7].

    Raises:
        IntegrityError: the shard is missing or ends too early, its bytes are not those that the index vouches for, or
            the index places members where they cannot be; names shard and clip.
    """
    shapes, sizes = _shapes_and_sizes(place.latents, latent_shape)
    _require_sound(place, sizes)
    in_order = [slots[name] for name in place.members]
    wanted = _headers(place, shapes) if checked else []
    headers = [memoryview(bytearray(min(len(one), gap))) for one, gap in zip(wanted, place.gaps, strict=False)]
    tails = _tails(place, in_order) if checked else _last_pose(place, in_order)
    pieces = _pieces(place, headers, in_order, tails)

    def read() -> None:
        with timing.measure(Part.STORE):
            _fill(reader, place, pieces)

    def damage() -> str | None:
        if not checked:
            return None
        with timing.measure(Part.CHECKSUM):
            return _damage(place, wanted, headers, in_order, tails)

    read_until_whole(reader, place.shard, place.key, read=read, damage=damage)
    return np.frombuffer((tails[-1] if tails[-1].nbytes else in_order[-1])[-POSE_BYTES:], STORED_DTYPES["poses"])


def _tails(place: ClipPlace, slots: Sequence[memoryview]) -> list[memoryview]:
    """Memory for what lies behind each slot, so that members are read to their end."""
    return [memoryview(bytearray(size - slot.nbytes)) for size, slot in zip(place.sizes, slots, strict=True)]


def _last_pose(place: ClipPlace, slots: Sequence[memoryview]) -> list[memoryview]:
    """Memory for the one thing that is needed behind a prefix: the pose at the end of the clip."""
    size = min(place.sizes[-1] - slots[-1].nbytes, POSE_BYTES)
    return [*[_NOTHING] * (len(slots) - 1), memoryview(bytearray(size))]


@lru_cache(maxsize=4096)
def _shapes_and_sizes(
    latents: int, latent_shape: tuple[int, int, int]
) -> tuple[Mapping[str, tuple[int, ...]], Mapping[str, int]]:
    """Shape, and bytes, of each member of a clip of so many latents that batches may need."""
    axes = dict(zip("FChwT", (latents, *latent_shape, frames_of(latents)), strict=True))
    shapes = {name: shape_of(name, axes) for name in READ_MEMBERS}
    return shapes, {name: prod(shape) * STORED_DTYPES[name].itemsize for name, shape in shapes.items()}


def _headers(place: ClipPlace, shapes: Mapping[str, tuple[int, ...]]) -> list[bytes]:
    """The bytes that must stand right before each member: its headers, and the padding of a member just before."""
    headers = []
    before = 0  # bytes of the member before, in whole blocks and in part
    for name, gap, size in zip(place.members, place.gaps, place.sizes, strict=True):
        header = array_header(place.key, name, shapes[name])
        padding = padded(before) - before
        headers.append(header if gap > padding + len(header) else bytes(padding) + header)
        before = NPY_HEADER_BYTES + size
    return headers


def _pieces(
    place: ClipPlace, headers: Sequence[memoryview], slots: Sequence[memoryview], tails: Sequence[memoryview]
) -> list[tuple[int, memoryview]]:
    """What is read: offset in the shard and memory for it, in the order of the offsets."""
    pieces = list(zip(place.offsets, slots, strict=True))
    pieces += [(offset - header.nbytes, header) for offset, header in zip(place.offsets, headers, strict=False)]
    ends = map(add, place.offsets, place.sizes)
    pieces += [(end - tail.nbytes, tail) for end, tail in zip(ends, tails, strict=True) if tail.nbytes]
    return sorted(pieces, key=itemgetter(0))


def _fill(reader: ShardReader, place: ClipPlace, pieces: Sequence[tuple[int, memoryview]]) -> None:
    """Read pieces that stand close together at once, with what lies between them."""
    start = end = place.clip_offset
    buffers: list[memoryview] = []
    for offset, buffer in pieces:
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


def _damage(
    place: ClipPlace,
    wanted: Sequence[bytes],
    headers: Sequence[memoryview],
    slots: Sequence[memoryview],
    tails: Sequence[memoryview],
) -> str | None:
    """The first thing that is wrong with the bytes that were read, member by member."""
    for name, header, right in zip(place.members, headers, wanted, strict=True):
        if header != right:
            return wrong_header(f"{name}.npy")
    for name, checksum, slot, tail in zip(place.members, place.checksums, slots, tails, strict=True):
        found = _checksum(slot, tail)
        if found != checksum:
            return wrong_checksum(f"{name}.npy", f"{checksum:016x}", f"{found:016x}")
    return None


def _checksum(slot: memoryview, tail: memoryview) -> int:
    if not tail.nbytes:
        return xxhash.xxh3_64_intdigest(slot)
    state = xxhash.xxh3_64(slot)
    state.update(tail)
    return state.intdigest()


def _require_sound(place: ClipPlace, sizes: Mapping[str, int]) -> None:
    """The index must give the members the sizes of a clip, one behind the other, with room for headers between them."""
    gaps, passed_over = place.gaps, sum(sizes.values()) - sum(sizes[name] for name in place.members)
    if (
        place.sizes != tuple(sizes[name] for name in place.members)
        or min(gaps) <= 0
        or max(gaps) > MAX_GAP_BYTES + passed_over
    ):
        raise IntegrityError(
            f"{place.where}: {INDEX_NAME} places members where a clip of {place.latents} latents does not have them, "
            f"at {place.offsets} with {place.sizes} bytes; restore the index"
        )
