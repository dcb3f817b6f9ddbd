"""What a loader hands to a model: some clips of one global step, as tensors, and what is known of them."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.sequence import SequenceSpan

TensorT = TypeVar("TensorT")


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipBatch(Generic[TensorT]):
    """What one rank has of one global step: R rows of L latents, in which N sequences lie.

    Padding is zero, and `sequence_id` is -1 there. All but tensors is on the processor, wherever the tensors are.

    Attributes:
        rgb: colour latents; [R, L, C, h, w].
        depth: depth latents; [R, L, C, h, w]. None where they were not asked for.
        depth_valid: share of pixels with a depth measurement, 0 to 255; uint8 [R, L, h, w]. None likewise.
        poses: camera in the first camera's frame, x, y, z (m) and quaternion w, x, y, z; float32 [R, L, 4, 7]. Slot
            m = 0..3 of latent j >= 1 is raw frame 4 (j - 1) + m + 1; latent 0 has the identity four times.
        still: pose slots of still frames that were added at the end of a clip; bool [R, L, 4].
        sequence_id: number of the sequence in the batch, -1 where there is none; int32 [R, L].
        latent_index: number of the latent in its sequence; int32 [R, L].
        goal_camera0_m: last camera position of the whole clip in the first camera's frame, m; float32 [N, 3].
        spans: where each sequence lies, and its chunk size.
        refs: numbers of the clips over all sources; int64 [N].
        keys: keys of the clips.
        epoch: number of the epoch.
        step: number of the global step in the epoch.
    """

    rgb: TensorT
    poses: TensorT
    still: TensorT
    sequence_id: TensorT
    latent_index: TensorT
    goal_camera0_m: TensorT
    spans: tuple[SequenceSpan, ...]
    refs: Int64Array
    keys: tuple[str, ...]
    epoch: int
    step: int
    depth: TensorT | None = None
    depth_valid: TensorT | None = None
