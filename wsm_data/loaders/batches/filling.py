"""How the clips of a step lie in its batch: rows, first latents, lengths, and everything that follows from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from wsm_data.loaders.batches.batch import LATENT_TENSORS, BatchBlock, BatchLayout, layout_of
from wsm_data.loaders.order.epoch_order import EpochOrder, chunk_sizes
from wsm_data.loaders.reading.clip_places import ClipPlace
from wsm_data.loaders.reading.clip_reads import POSE_BYTES
from wsm_data.schema.pose import IDENTITY_POSE, POSE_VALUES
from wsm_data.schema.sequence import POSE_SLOTS, SequenceSpan, frame_table

ANCHOR_SLOTS = POSE_SLOTS - 1
"""Slots of latent 0 that repeat the first pose: raw frame f of a clip lies in its slot `ANCHOR_SLOTS` + f."""

MEMBER_OF = {"rgb": "rgb_latent", "depth": "depth_latent", "depth_valid": "depth_valid", "poses": "poses"}
"""Tensors of a batch that are read, and the members they are read from."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BatchSequence:
    """A sequence of a batch.

    Attributes:
        place: where its clip is read.
        span: where it lies in the batch: the clip, or a prefix of it.
    """

    place: ClipPlace
    span: SequenceSpan


def sequences_of_rows(
    rows: Sequence[np.ndarray], places: Sequence[ClipPlace], epoch_order: EpochOrder
) -> list[BatchSequence]:
    """Lay the clips of each row one behind the other.

    Args:
        rows: refs in each row; int64 [clips of the row].
        places: places of the clips of all rows.
        epoch_order: says how many latents are taken of each clip, and its chunk size.
    """
    refs = np.concatenate(rows)
    lengths = epoch_order.sequence_latents[refs].tolist()
    sizes = chunk_sizes(refs, epoch_order.config, epoch_order.epoch).tolist()
    clips: list[BatchSequence] = []
    for row, row_refs in enumerate(rows):
        start = 0
        for number in range(len(clips), len(clips) + len(row_refs)):
            span = SequenceSpan(row=row, start=start, length=lengths[number], chunk_size=sizes[number])
            clips.append(BatchSequence(place=places[number], span=span))
            start = span.end
    return clips


def batch_layout(
    clips: Sequence[BatchSequence],
    rows: int,
    epoch_order: EpochOrder,
    latent_shape: tuple[int, int, int],
    dtype: torch.dtype,
    *,
    depth: bool = True,
) -> BatchLayout:
    """The sizes of a batch: rows as long as the longest one, or of `row_latents` of joined clips; never empty."""
    longest = max((clip.span.end for clip in clips), default=1)
    return layout_of(rows, epoch_order.config.row_latents or longest, len(clips), latent_shape, dtype, depth=depth)


def slots_of(block: BatchBlock, clip: BatchSequence) -> dict[str, memoryview]:
    """Memory of a clip in each tensor that is read from its shard.

    Returns:
        By name of the member, the bytes from the clip's first latent to its last; for `poses`, from raw frame 0 on.
    """
    span = clip.span
    slots = {
        member: block.bytes[_stretch(block.layout, name, span.row, span.start, span.length)]
        for name, member in MEMBER_OF.items()
        if name in block.layout.tensors
    }
    slots["poses"] = slots["poses"][ANCHOR_SLOTS * POSE_BYTES :]
    return slots


def describe(block: BatchBlock, clips: Sequence[BatchSequence], goals: Sequence[np.ndarray]) -> None:
    """Fill in everything but what was read: masks, goals, anchors, and zeros where there is no clip.

    Args:
        block: the batch.
        clips: its clips.
        goals: last camera position of each, m; N of float32 [3].
    """
    layout, memory = block.layout, block.bytes
    arrays = {name: _array(layout, memory, name) for name in layout.tensors if name not in LATENT_TENSORS}
    by_slot = (layout.rows, POSE_SLOTS * layout.row_latents)
    still, poses = arrays["still"].reshape(by_slot), arrays["poses"].reshape(*by_slot, POSE_VALUES)
    table = frame_table([clip.span for clip in clips], layout.rows, layout.row_latents)
    still[:], arrays["sequence_id"][:], arrays["latent_index"][:] = False, table.sequence, table.latent
    used = [0] * layout.rows
    for clip in clips:
        row, frame_0 = clip.span.row, POSE_SLOTS * clip.span.start + ANCHOR_SLOTS
        used[row] = clip.span.end
        poses[row, frame_0 - ANCHOR_SLOTS : frame_0] = IDENTITY_POSE
        real_frames = clip.place.frames - clip.place.padded_frames
        still[row, frame_0 + real_frames : POSE_SLOTS * clip.span.end] = True
    for row, end in enumerate(used):
        _clear(layout, memory, row, end)
    for number, goal in enumerate(goals):
        arrays["goal_camera0_m"][number] = goal


def _clear(layout: BatchLayout, memory: memoryview, row: int, end: int) -> None:
    """Zeros behind the last sequence of a row."""
    unused = layout.row_latents - end
    for name in (one for one in MEMBER_OF if unused and one in layout.tensors):
        np.frombuffer(memory[_stretch(layout, name, row, end, unused)], np.uint8)[:] = 0


def _stretch(layout: BatchLayout, name: str, row: int, start: int, latents: int) -> slice:
    """Bytes of some latents of a row in a tensor."""
    offset, of_row, of_latent = layout.strides_bytes[name]
    first = offset + row * of_row + start * of_latent
    return slice(first, first + latents * of_latent)


def _array(layout: BatchLayout, memory: memoryview, name: str) -> np.ndarray:
    place = layout.tensors[name]
    return np.ndarray(place.shape, str(place.dtype).removeprefix("torch."), memory, place.offset)
