"""What the model is given and what it answers.

Shape suffixes: B rows, F latents of a row, N sequences, M pose slots, C channels, h rows and w columns of a latent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from torch import Tensor

from wsm_data.schema.sequence import FrameTable, SequenceSpan, frame_table


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelInputs:
    """A teacher-forced batch.

    Attributes:
        rgb: clean RGB latents, standardised, [B, F, C, h, w].
        depth: clean depth latents, standardised, [B, F, C, h, w]; what estimates are compared with. None without SLAM.
        poses: poses of the raw frames in the first camera's frame, [B, F, M, 7]: xyz (m), unit quaternion wxyz.
        goal_camera0_m: goal of each sequence in its first camera's frame, [N, 3], m.
        noisy_rgb: noisy RGB latents, [B, F, C, h, w].
        flow_time: tau of each latent, the same within a chunk, [B, F].
        spans: where the sequences stand.
        depth_context: what later chunks see of the depth, [B, F, C, h, w]; None: the depth itself.
        rgb_context: what is seen of the clean RGB, [B, F, C, h, w]; None: the RGB itself.
    """

    rgb: Tensor
    depth: Tensor | None
    poses: Tensor
    goal_camera0_m: Tensor
    noisy_rgb: Tensor
    flow_time: Tensor
    spans: Sequence[SequenceSpan]
    depth_context: Tensor | None = None
    rgb_context: Tensor | None = None

    @cached_property
    def table(self) -> FrameTable:
        """Sequence, latent and chunk of every frame, on the processor."""
        rows, latents = self.rgb.shape[:2]
        return frame_table(self.spans, rows, latents)


@dataclass(frozen=True, kw_only=True)
class ModelOutputs:
    """Predictions for every latent of a batch; those of padding mean nothing.

    Attributes:
        velocity: of the flow, eps - x, [B, F, C, h, w].
        depth: depth latents, standardised, [B, F, C, h, w]; None without SLAM.
        poses: [B, F, M, 7], float32: xyz (m), unit quaternion wxyz.
    """

    velocity: Tensor
    depth: Tensor | None
    poses: Tensor
