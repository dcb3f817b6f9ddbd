"""The pretraining objective (paper, equation 8): L_FM + lambda_d L_d + lambda_p (L_abs + L_rel)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from wsm_data.schema.sequence import NO_SEQUENCE, FrameTable, SequenceSpan
from wsm_model.inputs import ModelInputs, ModelOutputs
from wsm_model.losses.flow import flow_errors
from wsm_model.losses.pose import pose_losses, raw_frame_poses


@dataclass(frozen=True, kw_only=True)
class LossConfig:
    """Weights of the parts (paper, table "Pretraining hyperparameters").

    Attributes:
        depth: weight lambda_d of the loss of depth.
        pose: weight lambda_p of the loss of poses.
        pose_delta: delta of the smooth-L1 norm, m and quaternion units.
        flow_shift: gamma of the flow time.
    """

    depth: float = 1.0
    pose: float = 0.5
    pose_delta: float = 0.1
    flow_shift: float = 5.0

    def __post_init__(self) -> None:
        for name in ("depth", "pose"):
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be a weight of at least 0, found {getattr(self, name)}")
        for name in ("pose_delta", "flow_shift"):
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be above 0, found {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True)
class LossCounts:
    """What the means of a step are taken over; those of a whole step are the sums over its parts and ranks.

    Attributes:
        dreamed: latents that are dreamed: all but the anchors.
        latents: latents.
        sequences: sequences.
    """

    dreamed: float
    latents: float
    sequences: float


@dataclass(frozen=True, kw_only=True)
class LossReport:
    """Scalars with gradients.

    Attributes:
        total: what is minimised.
        parts: flow, depth, pose_absolute, pose_relative, each before its weight; no depth without SLAM.
    """

    total: Tensor
    parts: Mapping[str, Tensor]


def loss_counts(spans: Sequence[SequenceSpan]) -> LossCounts:
    """Counts of some sequences."""
    latents = sum(span.length for span in spans)
    return LossCounts(dreamed=latents - len(spans), latents=latents, sequences=len(spans))


def counted_frames(table: FrameTable, device: torch.device) -> tuple[Tensor, Tensor]:
    """Latents of sequences, and those of them that are dreamed: all but the anchors; bool [B, F] each."""
    real = table.sequence != NO_SEQUENCE
    return torch.from_numpy(real).to(device), torch.from_numpy(real & (table.latent > 0)).to(device)


def pretraining_loss(
    inputs: ModelInputs,
    outputs: ModelOutputs,
    noise: Tensor,
    config: LossConfig,
    counts: LossCounts | None = None,
) -> LossReport:
    """All parts of the objective.

    The flow and depth parts are means over latents, the pose parts means over sequences of each one's mean over frames
    and pairs.

    Args:
        inputs: the batch.
        outputs: what the model said of it.
        noise: eps that `inputs.noisy_rgb` was made with, [B, F, C, h, w].
        config: weights.
        counts: what to divide by, where the batch is a part of a step; the parts of a step then add up to its losses.
    """
    counts = counts or loss_counts(inputs.spans)
    device = outputs.velocity.device
    real, dreamed = counted_frames(inputs.table, device)
    errors = flow_errors(outputs.velocity, inputs.rgb, noise, inputs.flow_time, config.flow_shift)
    parts = {"flow": _sum_where(errors, dreamed) / max(1.0, counts.dreamed)}
    if outputs.depth is not None and inputs.depth is not None:
        squared = (outputs.depth.float() - inputs.depth.float()).square().flatten(2).mean(-1)
        parts["depth"] = _sum_where(squared, real) / counts.latents
    parts |= _pose_parts(inputs, outputs, config, counts)
    total = parts["flow"] + config.pose * (parts["pose_absolute"] + parts["pose_relative"])
    if "depth" in parts:
        total = total + config.depth * parts["depth"]
    return LossReport(total=total, parts=parts)


def _sum_where(values: Tensor, counted: Tensor) -> Tensor:
    """Sum of the values that count; what does not count changes no sum, even where it is not finite."""
    return torch.where(counted, values, torch.zeros((), device=values.device, dtype=values.dtype)).sum()


def _pose_parts(
    inputs: ModelInputs, outputs: ModelOutputs, config: LossConfig, counts: LossCounts
) -> dict[str, Tensor]:
    found = []
    for span in inputs.spans:
        predicted, target = (raw_frame_poses(poses[span.place].float()) for poses in (outputs.poses, inputs.poses))
        found.append(pose_losses(predicted, target, config.pose_delta))
    absolute, relative = (torch.stack(part).sum() / counts.sequences for part in zip(*found, strict=True))
    return {"pose_absolute": absolute, "pose_relative": relative}
