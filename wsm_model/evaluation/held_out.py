"""How well a model estimates states and dreams on clips it was not trained on, beside what knows nothing.

States are estimated as in use: one latent after the other through the cache, on the model's own earlier estimates.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_data.metrics.trajectory import ate_rmse_unaligned_m
from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import chunk_start
from wsm_model.batches import TrainingInputs, training_inputs
from wsm_model.evaluation.trajectory import constant_velocity, zero_motion
from wsm_model.inference.session import Session, SessionConfig
from wsm_model.losses.flow import flow_errors
from wsm_model.losses.pose import raw_frame_poses
from wsm_model.losses.total import counted_frames
from wsm_model.model import WorldSlamModel


@dataclass(frozen=True, kw_only=True)
class ClipErrors:
    """Errors on one clip.

    Attributes:
        key: of the clip.
        ate_rmse_unaligned_m: camera centres of the recorded frames, not aligned, m; still frames that were added do
            not count.
        ate_rmse_zero_motion_m: of a camera that stays.
        ate_rmse_constant_velocity_m: of a camera that goes on as it truly began.
        depth_mse: of standardised depth latents.
        mean_depth_mse: of predicting the training mean.
    """

    key: str
    ate_rmse_unaligned_m: float
    ate_rmse_zero_motion_m: float
    ate_rmse_constant_velocity_m: float
    depth_mse: float
    mean_depth_mse: float


@dataclass(frozen=True, kw_only=True)
class FlowErrors:
    """Flow-matching losses over the same noise.

    Attributes:
        model: of the model.
        copy: of taking each chunk for a copy of the last latent before it.
        unconditional: of the best velocity for standard normal latents that are seen through their noise alone.
    """

    model: float
    copy: float
    unconditional: float


@torch.no_grad()
def estimate_states(model: WorldSlamModel, rgb_FChw: Tensor, config: SessionConfig) -> tuple[Tensor, Tensor]:
    """Depth latents [F, C, h, w] and pose slots [F, M, 7] of one clip, each as it was last estimated."""
    session = Session(model, config)
    episode = session.start()
    depth = torch.zeros_like(rgb_FChw)
    poses = torch.zeros(len(rgb_FChw), model.config.pose_slots, 7, device=rgb_FChw.device)
    for latent in rgb_FChw:
        (states,) = session.observe([episode], latent[None])
        window = slice(states.first, states.first + len(states.poses))
        poses[window] = states.poses
        if states.depth is not None:
            depth[window] = states.depth
    return depth, poses


def clip_errors(model: WorldSlamModel, batch: ClipBatch[Tensor], config: SessionConfig) -> list[ClipErrors]:
    """Errors of every clip of a batch that has depth."""
    if batch.depth is None:
        raise ValueError("errors of states need a batch with depth, found one without")
    found = []
    for number, span in enumerate(batch.spans):
        place = span.place
        depth, poses = estimate_states(model, batch.rgb[place].float(), config)
        recorded = ~batch.still[place].flatten()[-len(raw_frame_poses(poses)) :].cpu()
        estimated, true = (
            raw_frame_poses(slots.float().cpu())[recorded, :3].double().numpy() for slots in (poses, batch.poses[place])
        )
        found.append(
            ClipErrors(
                key=batch.keys[number],
                ate_rmse_unaligned_m=ate_rmse_unaligned_m(estimated, true),
                ate_rmse_zero_motion_m=ate_rmse_unaligned_m(zero_motion(true), true),
                ate_rmse_constant_velocity_m=ate_rmse_unaligned_m(constant_velocity(true), true),
                depth_mse=float((depth - batch.depth[place].float()).square().mean()),
                mean_depth_mse=float(batch.depth[place].float().square().mean()),
            )
        )
    return found


@torch.no_grad()
def flow_matching_errors(
    model: WorldSlamModel, batches: Iterable[ClipBatch[Tensor]], *, seed: int, shift: float
) -> FlowErrors:
    """Flow-matching losses, means over the latents that are dreamed.

    Args:
        model: in evaluation mode.
        batches: of held-out clips.
        seed: of noise and flow times.
        shift: gamma.
    """
    sums, count = np.zeros(3), 0
    for batch in batches:
        for part in training_inputs(batch, seed=seed, flow_shift=shift):
            _, counted = counted_frames(part.inputs.table, part.noise.device)
            guesses = (model(part.inputs).velocity, _copy_velocity(part), _unconditional_velocity(part))
            for number, velocity in enumerate(guesses):
                errors = flow_errors(velocity, part.inputs.rgb, part.noise, part.inputs.flow_time, shift)
                sums[number] += float(errors[counted].sum())
            count += int(counted.sum())
    of_model, copy, unconditional = (float(value) for value in sums / max(1, count))
    return FlowErrors(model=of_model, copy=copy, unconditional=unconditional)


def _copy_velocity(part: TrainingInputs) -> Tensor:
    """(x_tau - x_last) / tau, where x_last is the last latent before the chunk."""
    inputs = part.inputs
    copied = inputs.rgb.clone()
    for span in inputs.spans:
        for latent in range(1, span.length):
            last = chunk_start(latent, span.chunk_size) - 1
            copied[span.row, span.start + latent] = inputs.rgb[span.row, span.start + last]
    tau = inputs.flow_time[..., None, None, None].clamp(min=1e-3)
    return (inputs.noisy_rgb - copied) / tau


def _unconditional_velocity(part: TrainingInputs) -> Tensor:
    """E[eps - x | x_tau] for x and eps standard normal: (tau - (1 - tau)) / (tau^2 + (1 - tau)^2) x_tau."""
    tau = part.inputs.flow_time[..., None, None, None]
    return (2 * tau - 1) / (tau.square() + (1 - tau).square()) * part.inputs.noisy_rgb


def mean_of(errors: Sequence[ClipErrors], name: str) -> float:
    """Mean of one error over the clips."""
    return float(np.mean([getattr(one, name) for one in errors]))
