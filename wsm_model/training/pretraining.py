"""A step of pretraining on the objective (paper, section 3.3 and appendix B.1)."""

import math
from dataclasses import replace

import torch
from torch import Tensor

from wsm_data.schema.batch import ClipBatch
from wsm_model.batches import ContextNoise, TrainingInputs, training_inputs
from wsm_model.losses.total import LossCounts, loss_counts, pretraining_loss
from wsm_model.model import WorldSlamModel
from wsm_model.precision import autocast
from wsm_model.ranks import rank_and_world_size, sum_over_ranks
from wsm_model.training.config import TrainingConfig
from wsm_model.training.loop import StepResult, TrainingRun, finish_step
from wsm_model.training.work import StepWork, work_of


def pretraining_step(
    model: WorldSlamModel, run: TrainingRun, config: TrainingConfig, batch: ClipBatch[Tensor]
) -> StepResult:
    """One step of the optimiser on this rank's share of a global batch.

    Losses are means over the whole global batch, so neither the number of ranks nor `micro_rows` changes them.

    Raises:
        NumericalError: a loss or a gradient is not finite; names step, clips and parts.
    """
    device = batch.rgb.device
    counts, work = _global_counts(model, batch, device)
    sums: dict[str, float] = {}
    bad: list[str] = []
    parts = training_inputs(
        batch,
        seed=config.seed,
        flow_shift=config.loss.flow_shift,
        context=ContextNoise(
            depth=config.depth_noise, rgb=config.rgb_noise, rgb_probability=config.rgb_noise_probability
        ),
        micro_rows=config.micro_rows,
    )
    run.optimiser.zero_grad(set_to_none=True)
    for part in parts:
        losses = _backward(model, part, config, counts)
        for name, value in losses.items():
            sums[name] = sums.get(name, 0.0) + value
        if not all(math.isfinite(value) for value in losses.values()):
            bad += part.keys
    names = sorted(sums)
    totals = dict(zip(names, sum_over_ranks([sums[name] for name in names], device), strict=True))
    taken = finish_step(run, totals, config.optimiser.clip_norm, lambda wrong: _not_finite(batch, wrong, bad))
    return replace(taken, work=work)


def _backward(
    model: WorldSlamModel, part: TrainingInputs, config: TrainingConfig, counts: LossCounts
) -> dict[str, float]:
    _, world_size = rank_and_world_size()
    with autocast(config.precision, part.noise.device):
        outputs = model(part.inputs)
    report = pretraining_loss(part.inputs, outputs, part.noise, config.loss, counts)
    (report.total * world_size).backward()  # gradients are averaged over the ranks
    names = ["loss", *report.parts]
    values = torch.stack([report.total.detach(), *(value.detach() for value in report.parts.values())]).tolist()
    return dict(zip(names, values, strict=True))


def _global_counts(
    model: WorldSlamModel, batch: ClipBatch[Tensor], device: torch.device
) -> tuple[LossCounts, StepWork]:
    """What means are taken over, and what is worked through, over all ranks."""
    own, work = loss_counts(batch.spans), work_of(model, batch.spans)
    given = [own.dreamed, own.latents, own.sequences, work.tokens, work.flop]
    dreamed, latents, sequences, tokens, flop = sum_over_ranks(given, device)
    counts = LossCounts(dreamed=dreamed, latents=latents, sequences=sequences)
    return counts, StepWork(latents=latents, tokens=tokens, flop=flop)


def _not_finite(batch: ClipBatch[Tensor], wrong: str, bad: list[str]) -> str:
    given = {name: getattr(batch, name) for name in ("rgb", "depth", "poses", "goal_camera0_m")}
    inputs = [name for name, values in given.items() if values is not None and not _finite(values)]
    cause = f"the batch itself holds NaN or infinity in {', '.join(inputs)}" if inputs else "the batch is finite"
    return (
        f"epoch {batch.epoch}, step {batch.step}: losses and gradients must be finite, found {wrong} not "
        f"finite for the clips {', '.join(bad or batch.keys)}; {cause}. Nothing was written over the last checkpoint. "
        "Check the clips with `wsm verify`, lower the learning rate or train in float32, and run the same command again"
    )


def _finite(values: Tensor) -> bool:
    return bool(torch.isfinite(values).all())
