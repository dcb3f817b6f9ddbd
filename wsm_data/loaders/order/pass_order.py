"""The order in which one source gives its clips in one pass: shuffled, and yet near to how the clips are stored.

Clips that stand together in a shard form blocks. The blocks are permuted over the whole source, and the clips are
permuted among those of a few consecutive blocks, a window. Whoever reads along the order therefore has the shards of
one window open at a time, and never comes back to a shard whose window is over.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.stable_hash import Draw, mix64, permutation
from wsm_data.schema.arrays import Int64Array

Int32Array = NDArray[np.int32]


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceLayout:
    """What the order of a source depends on.

    Attributes:
        shard_clips: clips of the source in each of its shards, all above 0; int64 [shards].
        latents: latents of each clip, in the order of the index; int32 [clips].
        weight: passes over the source in an epoch.
    """

    shard_clips: Int64Array
    latents: Int32Array
    weight: float = 1.0

    def __post_init__(self) -> None:
        if int(self.shard_clips.sum()) != len(self.latents) or not (self.shard_clips > 0).all():
            raise ValueError(f"shard_clips must be above 0 and add up to the {len(self.latents)} clips of the source")

    def __len__(self) -> int:
        return len(self.latents)


def pass_order(shard_clips: Int64Array, order: OrderConfig, *, source: int, number: int) -> Int64Array:
    """Numbers of the clips of a source in the order of one pass; each comes once.

    Args:
        shard_clips: clips of the source in each of its shards; int64 [shards].
        order: seed, and how the clips are permuted.
        source: number of the source in the loader; two equal sources come in different orders.
        number: number of the pass, from 0; each has an order of its own.

    Returns:
        int64 [clips].
    """
    clips = int(shard_clips.sum())
    if not order.shuffle or not clips:
        return np.arange(clips)
    sizes = _blocks(shard_clips, order.block_clips)
    permuted = permutation(mix64(np.arange(len(sizes)), order.seed, Draw.BLOCKS, source, number))
    in_blocks = _joined((np.cumsum(sizes) - sizes)[permuted], sizes[permuted])
    windows = np.add.reduceat(sizes[permuted], np.arange(0, len(sizes), order.window_blocks))
    hashes = mix64(in_blocks, order.seed, Draw.CLIPS, source, number)
    return in_blocks[permutation(hashes, windows)]


def _blocks(shard_clips: Int64Array, block_clips: int) -> Int64Array:
    """Clips of each block: shards cut into pieces of `block_clips`, the last piece of a shard as it comes."""
    if not block_clips:
        return shard_clips
    blocks = -(-shard_clips // block_clips)
    sizes = np.full(int(blocks.sum()), block_clips, np.int64)
    sizes[np.cumsum(blocks) - 1] = shard_clips - (blocks - 1) * block_clips
    return sizes


def _joined(starts: Int64Array, sizes: Int64Array) -> Int64Array:
    """The numbers of all stretches, one stretch after the other."""
    shifts = starts - (np.cumsum(sizes) - sizes)
    return np.repeat(shifts, sizes) + np.arange(int(sizes.sum()))
