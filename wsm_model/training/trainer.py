"""Pretraining: the loop around the objective (paper, section 3.3 and appendix B.1)."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from wsm_data.errors import NumericalError
from wsm_data.schema.batch import ClipBatch
from wsm_model.batches import TrainingInputs, training_inputs
from wsm_model.losses.total import LossCounts, loss_counts, pretraining_loss
from wsm_model.model import WorldSlamModel
from wsm_model.ranks import rank_and_world_size, sum_over_ranks, whole
from wsm_model.training.checkpoint import (
    TrainingState,
    checkpoints,
    drop_old_checkpoints,
    load_checkpoint,
    save_checkpoint,
)
from wsm_model.training.config import Precision, TrainingConfig
from wsm_model.training.metrics import MetricsWriter
from wsm_model.training.schedule import learning_rate, make_optimiser, set_learning_rate


class BatchSource(Protocol):
    """A loader: iterating gives the rest of an epoch, and its state says where it stands."""

    @property
    def steps(self) -> int:
        """Steps of an epoch."""

    def __iter__(self) -> Iterator[ClipBatch[Tensor]]: ...

    def state_dict(self) -> dict[str, Any]:
        """Where it stands, as JSON."""

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go to where a state says."""


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """One optimiser step.

    Attributes:
        losses: total and parts, over all ranks.
        gradient_norm: before clipping.
    """

    losses: Mapping[str, float]
    gradient_norm: float


@dataclass(frozen=True, kw_only=True)
class Hooks:
    """What is called on the way.

    Attributes:
        metrics: takes the numbers of a step; called on the first rank.
        sample: draws pictures after a step; called on every rank.
        progress: takes the number of steps done, on the first rank.
    """

    metrics: MetricsWriter
    sample: Callable[[int], None]
    progress: Callable[[int], None]


def total_steps(config: TrainingConfig, loader: BatchSource) -> int:
    """Optimiser steps of a run."""
    return config.max_steps or config.epochs * loader.steps


def resume(
    folder: Path,
    model: WorldSlamModel,
    optimiser: torch.optim.Optimizer,
    loader: BatchSource,
    identity: Mapping[str, object],
) -> int:
    """Go to the latest checkpoint, if there is one; returns the steps done.

    Raises:
        ConfigError: it belongs to another run.
        IntegrityError: it is damaged.
    """
    found = checkpoints(folder)
    if not found:
        return 0
    state = load_checkpoint(found[-1], model, optimiser, identity)
    loader.load_state_dict(dict(state.loader))
    return state.step


def train(
    model: WorldSlamModel,
    loader: BatchSource,
    config: TrainingConfig,
    *,
    folder: Path,
    identity: Mapping[str, object],
    hooks: Hooks,
    optimiser: torch.optim.Optimizer | None = None,
    done: int = 0,
) -> None:
    """Train until the schedule ends; checkpoints go into `folder`.

    Args:
        model: on its device, sharded if there are several ranks.
        loader: of this rank.
        config: settings.
        folder: of the checkpoints.
        identity: what the run is made from.
        hooks: metrics, pictures and progress.
        optimiser: as `resume` filled it; None: a new one.
        done: steps done before.

    Raises:
        NumericalError: a loss or a gradient is not finite; names step, clips and parts. No checkpoint is written.
    """
    optimiser = optimiser or make_optimiser(model, config.optimiser)
    model.checkpoint_activations = config.checkpoint_activations
    model.train()
    steps = total_steps(config, loader)
    rank, _ = rank_and_world_size()
    while done < steps:
        for batch in loader:
            started_s = time.perf_counter()
            rate = learning_rate(done, steps, config.optimiser)
            set_learning_rate(optimiser, rate)
            result = train_step(model, optimiser, batch, config)
            done += 1
            if rank == 0:
                hooks.progress(done)
                if done % config.log_every == 0 or done == steps:
                    seconds = time.perf_counter() - started_s
                    extra = {"gradient_norm": result.gradient_norm, "learning_rate": rate, "seconds": seconds}
                    hooks.metrics(done, {**result.losses, **extra})
            if config.sample_every and done % config.sample_every == 0:
                hooks.sample(done)
            if done % config.checkpoint_every == 0 or done == steps:
                state = TrainingState(step=done, loader=loader.state_dict(), identity=identity)
                save_checkpoint(folder, model, optimiser, state)
                if rank == 0:
                    drop_old_checkpoints(folder, config.keep_checkpoints)
            if done == steps:
                break


def train_step(
    model: WorldSlamModel, optimiser: torch.optim.Optimizer, batch: ClipBatch[Tensor], config: TrainingConfig
) -> StepResult:
    """One step of the optimiser on this rank's share of a global batch.

    Losses are means over the whole global batch, so neither the number of ranks nor `micro_rows` changes them.

    Raises:
        NumericalError: a loss or a gradient is not finite.
    """
    device = batch.rgb.device
    _, world_size = rank_and_world_size()
    counts = _global_counts(batch, device)
    sums: dict[str, float] = {}
    bad: list[str] = []
    parts = training_inputs(
        batch,
        seed=config.seed,
        flow_shift=config.loss.flow_shift,
        depth_noise=config.depth_noise,
        micro_rows=config.micro_rows,
    )
    optimiser.zero_grad(set_to_none=True)
    for part in parts:
        losses = _backward(model, part, config, counts, world_size)
        for name, value in losses.items():
            sums[name] = sums.get(name, 0.0) + value
        if not all(math.isfinite(value) for value in losses.values()):
            bad += part.keys
    names = sorted(sums)
    totals = dict(zip(names, sum_over_ranks([sums[name] for name in names], device), strict=True))
    norm = float(whole(clip_grad_norm_(model.parameters(), config.optimiser.clip_norm)))
    if not math.isfinite(norm) or not all(math.isfinite(value) for value in totals.values()):
        raise NumericalError(_not_finite(batch, totals, norm, bad))
    optimiser.step()
    return StepResult(losses=totals, gradient_norm=norm)


def _backward(
    model: WorldSlamModel, part: TrainingInputs, config: TrainingConfig, counts: LossCounts, world_size: int
) -> dict[str, float]:
    with _precision(config.precision, part.noise.device):
        outputs = model(part.inputs)
    report = pretraining_loss(part.inputs, outputs, part.noise, config.loss, counts)
    (report.total * world_size).backward()  # gradients are averaged over the ranks
    names = ["loss", *report.parts]
    values = torch.stack([report.total.detach(), *(value.detach() for value in report.parts.values())]).tolist()
    return dict(zip(names, values, strict=True))


def _global_counts(batch: ClipBatch[Tensor], device: torch.device) -> LossCounts:
    own = loss_counts(batch.spans)
    dreamed, latents, sequences = sum_over_ranks([own.dreamed, own.latents, own.sequences], device)
    return LossCounts(dreamed=dreamed, latents=latents, sequences=sequences)


def _precision(precision: Precision, device: torch.device) -> AbstractContextManager[Any]:
    return torch.autocast(device.type, torch.bfloat16, enabled=precision is Precision.BFLOAT16)


def _not_finite(batch: ClipBatch[Tensor], losses: Mapping[str, float], norm: float, bad: list[str]) -> str:
    parts = [name for name, value in losses.items() if not math.isfinite(value)] or [f"gradient norm {norm}"]
    inputs = [name for name in ("rgb", "depth", "poses", "goal_camera0_m") if not _finite(getattr(batch, name))]
    cause = f"the batch itself holds NaN or infinity in {', '.join(inputs)}" if inputs else "the batch is finite"
    return (
        f"epoch {batch.epoch}, step {batch.step}: losses and gradients must be finite, found {', '.join(parts)} not "
        f"finite for the clips {', '.join(bad or batch.keys)}; {cause}. Nothing was written over the last checkpoint. "
        "Check the clips with `wsm verify`, lower the learning rate or train in float32, and run the same command again"
    )


def _finite(values: Tensor) -> bool:
    return bool(torch.isfinite(values).all())
