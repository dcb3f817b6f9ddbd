"""What a loader hands to a model: some clips of one global step, as tensors, and what is known of them."""

from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, Self, TypeVar

from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.sequence import SequenceSpan


class _Tensor(Protocol):
    """What a batch asks of its tensors, of whatever library."""

    @property
    def shape(self) -> Any: ...

    def to(self, *args: Any, **options: Any) -> Any: ...


TensorT = TypeVar("TensorT", bound=_Tensor)

BATCH_TENSORS = (
    "rgb",
    "depth",
    "depth_valid",
    "poses",
    "still",
    "sequence_id",
    "latent_index",
    "goal_camera0_m",
)
"""Fields of a batch that are tensors."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        rows, latents, *latent = self.rgb.shape
        place = f"epoch {self.epoch} step {self.step}"
        sizes = f"{len(self.keys)} clips in {rows} rows of {latents} latents {' x '.join(map(str, latent))}"
        return f"<ClipBatch {place}: {sizes}>"

    def to(self, device: Any, *, non_blocking: bool = False) -> Self:
        """The same batch with its tensors on a device, as torch's `Tensor.to` takes it; dtypes stay."""
        tensors = {name: tensor for name in BATCH_TENSORS if (tensor := getattr(self, name)) is not None}
        moved = {name: tensor.to(device, non_blocking=non_blocking) for name, tensor in tensors.items()}
        return replace(self, **moved)
