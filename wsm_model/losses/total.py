"""The pretraining objective (paper, equation 8): L_FM + lambda_d L_d + lambda_p (L_abs + L_rel)."""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from wsm_model.inputs import ModelInputs, ModelOutputs
from wsm_model.losses.flow import flow_loss, flow_weight, mean_where
from wsm_model.losses.pose import pose_losses, raw_frame_poses


@dataclass(frozen=True, kw_only=True)
class LossConfig:
    """Weights of the parts (paper, table "Pretraining hyperparameters").

    Attributes:
        depth: lambda_d.
        pose: lambda_p.
        pose_delta: delta of the smooth-L1 norm, m and quaternion units.
        flow_shift: gamma of the flow time.
    """

    depth: float = 1.0
    pose: float = 0.5
    pose_delta: float = 0.1
    flow_shift: float = 5.0


@dataclass(frozen=True, kw_only=True)
class LossReport:
    """Scalars with gradients.

    Attributes:
        total: what is minimised.
        parts: flow, depth, pose_absolute, pose_relative, each before its weight; no depth without SLAM.
    """

    total: Tensor
    parts: Mapping[str, Tensor]


def pretraining_loss(inputs: ModelInputs, outputs: ModelOutputs, noise: Tensor, config: LossConfig) -> LossReport:
    """All parts of the objective.

    Args:
        inputs: the batch.
        outputs: what the model said of it.
        noise: eps that `inputs.noisy_rgb` was made with, [B, F, C, h, w].
        config: weights.
    """
    table = inputs.table()
    device = outputs.velocity.device
    real, dreamed = (table.sequence >= 0).to(device), ((table.sequence >= 0) & (table.latent > 0)).to(device)
    weight = flow_weight(inputs.flow_time.float(), config.flow_shift)
    parts = {"flow": flow_loss(outputs.velocity, inputs.rgb, noise, weight, dreamed)}
    total = parts["flow"]
    if outputs.depth is not None:
        error = (outputs.depth.float() - inputs.depth.float()).square().flatten(2).mean(-1)
        parts["depth"] = mean_where(error, real)
        total = total + config.depth * parts["depth"]
    parts |= _pose_parts(inputs, outputs, config)
    total = total + config.pose * (parts["pose_absolute"] + parts["pose_relative"])
    return LossReport(total=total, parts=parts)


def _pose_parts(inputs: ModelInputs, outputs: ModelOutputs, config: LossConfig) -> dict[str, Tensor]:
    """Means over the sequences, each normalised by its own number of frames and pairs."""
    found = []
    for span in inputs.spans:
        place = (span.row, slice(span.start, span.start + span.length))
        predicted, target = (raw_frame_poses(poses[place].float()) for poses in (outputs.poses, inputs.poses))
        found.append(pose_losses(predicted, target, config.pose_delta))
    absolute, relative = (torch.stack(part).mean() for part in zip(*found, strict=True))
    return {"pose_absolute": absolute, "pose_relative": relative}
