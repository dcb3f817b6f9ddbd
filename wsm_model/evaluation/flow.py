"""Flow-matching losses of a model on held-out clips, beside guesses that need no training."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import chunk_start
from wsm_model.batches import TrainingInputs, training_inputs
from wsm_model.losses.flow import flow_errors
from wsm_model.losses.total import counted_frames
from wsm_model.model import WorldSlamModel


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
