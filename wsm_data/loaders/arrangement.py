"""How the clips of a step lie in its batch: rows, first latents, lengths, and everything that follows from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from wsm_data.loaders.batch import NO_SEQUENCE, POSE_SLOTS, BatchLayout, PackedBatch
from wsm_data.loaders.clip_reads import POSE_BYTES, ClipPlace
from wsm_data.loaders.plan import EpochPlan
from wsm_data.schema.clip import TEMPORAL_RATIO

ANCHOR_SLOTS = POSE_SLOTS - 1
"""Slots of latent 0 that repeat the first pose: raw frame f of a clip lies in its slot `ANCHOR_SLOTS` + f."""

_IDENTITY = np.array([0, 0, 0, 1, 0, 0, 0], np.float32)


@dataclass(frozen=True, kw_only=True, slots=True)
class ArrangedClip:
    """A sequence of a batch.

    Attributes:
        place: where its clip is read.
        row: its row.
        start: its first latent in the row.
        latents: latents that are taken: the clip, or a prefix of it.
    """

    place: ClipPlace
    row: int
    start: int
    latents: int

    @property
    def frames(self) -> int:
        """Raw frames that are taken."""
        return 1 + TEMPORAL_RATIO * (self.latents - 1)


def arrange(rows: Sequence[np.ndarray], places: Sequence[ClipPlace], plan: EpochPlan) -> list[ArrangedClip]:
    """Lay the clips of each row one behind the other.

    Args:
        rows: refs in each row; int64 [clips of the row].
        places: places of the clips of all rows.
        plan: says how many latents are taken of each clip.
    """
    clips: list[ArrangedClip] = []
    for row, refs in enumerate(rows):
        start = 0
        for latents in plan.sequence_latents[refs].tolist():
            clips.append(ArrangedClip(place=places[len(clips)], row=row, start=start, latents=latents))
            start += latents
    return clips


def batch_layout(
    clips: Sequence[ArrangedClip], rows: int, plan: EpochPlan, latent_shape: tuple[int, int, int], dtype: torch.dtype
) -> BatchLayout:
    """The sizes of a batch: rows as long as the longest one, or of `row_latents` where they are packed; never empty."""
    longest = max((clip.start + clip.latents for clip in clips), default=1)
    return BatchLayout(
        rows=rows,
        row_latents=plan.order.row_latents or longest,
        sequences=len(clips),
        latent_shape=latent_shape,
        dtype=dtype,
    )


def slots_of(packed: PackedBatch, memory: memoryview, clip: ArrangedClip) -> dict[str, memoryview]:
    """Memory of a clip in each tensor that is read from its shard.

    Args:
        packed: the batch.
        memory: its block, as bytes.
        clip: the clip.

    Returns:
        By name of the tensor, the bytes from the clip's first latent to its last; for `poses`, from raw frame 0 on.
    """
    slots: dict[str, memoryview] = {}
    for name in ("rgb", "depth", "depth_valid", "poses"):
        place = packed.layout.tensors[name]
        latent_bytes = place.item_bytes // packed.layout.row_latents
        first = place.offset + clip.row * place.item_bytes + clip.start * latent_bytes
        slots[name] = memory[first : first + clip.latents * latent_bytes]
    slots["poses"] = slots["poses"][ANCHOR_SLOTS * POSE_BYTES :]
    return slots


def describe(packed: PackedBatch, clips: Sequence[ArrangedClip], chunk_size: np.ndarray, goals: np.ndarray) -> None:
    """Fill in everything but what was read: masks, lengths, goals, anchors, and zeros where there is no clip.

    Args:
        packed: the batch, in memory of the processor.
        clips: its clips.
        chunk_size: chunk size of each; int64 [N].
        goals: last camera position of each, m; float32 [N, 3].
    """
    arrays = {name: packed.tensor(name).numpy() for name in ("still", "sequence_id", "latent_index", "poses")}
    still, poses = (
        arrays[name].reshape(packed.layout.rows, -1, *arrays[name].shape[3:]) for name in ("still", "poses")
    )
    still[:] = False
    arrays["sequence_id"][:] = NO_SEQUENCE
    arrays["latent_index"][:] = 0
    used = [0] * packed.layout.rows
    for number, clip in enumerate(clips):
        end = used[clip.row] = clip.start + clip.latents
        arrays["sequence_id"][clip.row, clip.start : end] = number
        arrays["latent_index"][clip.row, clip.start : end] = np.arange(clip.latents)
        first = POSE_SLOTS * clip.start
        poses[clip.row, first : first + ANCHOR_SLOTS] = _IDENTITY
        real = clip.place.frames - clip.place.padded_frames
        still[clip.row, first + ANCHOR_SLOTS + real : POSE_SLOTS * end] = True
    for name in ("rgb", "depth", "depth_valid", "poses"):
        tensor = packed.tensor(name)
        for row, end in enumerate(used):
            if end < packed.layout.row_latents:
                tensor[row, end:] = 0
    numbers = {
        "row": [clip.row for clip in clips],
        "start": [clip.start for clip in clips],
        "lengths": [clip.latents for clip in clips],
        "chunk_size": chunk_size,
        "goal_camera0_m": goals,
    }
    for name, values in numbers.items():
        packed.tensor(name).numpy()[:] = values
