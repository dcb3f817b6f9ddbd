"""Which clip goes into which shard: a pure function of keys, sizes, splits and a seed."""

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from wsm_data.shards.names import shard_name
from wsm_data.shards.tar_format import END_OF_ARCHIVE

DEFAULT_SHARD_BYTES = 512 << 20


@dataclass(frozen=True, kw_only=True)
class PlacedClip:
    """A clip that is to be packed.

    Attributes:
        key: key of the clip.
        split: `train`, `test`, ...
        size_bytes: size of its fragment.
    """

    key: str
    split: str
    size_bytes: int


@dataclass(frozen=True, kw_only=True)
class ShardLayout:
    """The clips of one shard, in the order in which they are stored.

    Attributes:
        name: file name of the shard, such as `train-000000.tar`.
        split: split of all its clips.
        clips: what goes in.
    """

    name: str
    split: str
    clips: tuple[PlacedClip, ...]

    @property
    def size_bytes(self) -> int:
        """Size of the finished shard."""
        return sum(clip.size_bytes for clip in self.clips) + len(END_OF_ARCHIVE)


def lay_out_shards(
    clips: Iterable[PlacedClip], *, shard_bytes: int = DEFAULT_SHARD_BYTES, seed: int = 0
) -> tuple[ShardLayout, ...]:
    """Fill shards of at most `shard_bytes` with the clips of each split, in the order of sha256(seed, key).

    That order mixes scenes, does not depend on the order of the input, and leaves the relative order of all other clips
    as it was when one is added. A clip larger than `shard_bytes` gets a shard of its own.

    Raises:
        ValueError: a key occurs twice, or a split is not a word.
    """
    ordered = sorted(clips, key=lambda clip: (clip.split, _rank(seed, clip.key), clip.key))
    _require_unique(ordered)
    layouts: list[ShardLayout] = []
    for split in sorted({clip.split for clip in ordered}):
        bins = _fill([clip for clip in ordered if clip.split == split], shard_bytes)
        layouts += [
            ShardLayout(name=shard_name(split, number), split=split, clips=content)
            for number, content in enumerate(bins)
        ]
    return tuple(layouts)


def _rank(seed: int, key: str) -> bytes:
    return hashlib.sha256(f"{seed}\n{key}".encode()).digest()


def _require_unique(clips: Sequence[PlacedClip]) -> None:
    keys = sorted(clip.key for clip in clips)
    for first, second in pairwise(keys):
        if first == second:
            raise ValueError(f"a clip must be placed once, found {first!r} twice")


def _fill(clips: Sequence[PlacedClip], shard_bytes: int) -> Iterator[tuple[PlacedClip, ...]]:
    content: list[PlacedClip] = []
    size = len(END_OF_ARCHIVE)
    for clip in clips:
        if content and size + clip.size_bytes > shard_bytes:
            yield tuple(content)
            content, size = [], len(END_OF_ARCHIVE)
        content.append(clip)
        size += clip.size_bytes
    if content:
        yield tuple(content)
