"""The loop that pretraining and post-training share: schedule, metrics, pictures, checkpoints, and exact resume."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

import torch
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_

from wsm_data.errors import NumericalError, Preempted
from wsm_model.ranks import any_rank, rank_and_world_size, whole
from wsm_model.training.average import WeightAverage, follow
from wsm_model.training.checkpoint import (
    NOTHING,
    TrainingState,
    checkpoints,
    drop_old_checkpoints,
    load_checkpoint,
    save_checkpoint,
)
from wsm_model.training.config import LoopConfig
from wsm_model.training.metrics import MetricsWriter
from wsm_model.training.schedule import learning_rate, set_learning_rate
from wsm_model.training.work import StepWork, peak_memory_gib, speed

BatchT = TypeVar("BatchT")
BatchT_co = TypeVar("BatchT_co", covariant=True)


class BatchSource(Protocol[BatchT_co]):
    """A loader: iterating gives the rest of an epoch, and its state says where it stands."""

    @property
    def steps(self) -> int:
        """Steps of an epoch."""

    def __iter__(self) -> Iterator[BatchT_co]: ...

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
        work: what it worked through, where that is counted.
    """

    losses: Mapping[str, float]
    gradient_norm: float
    work: StepWork | None = None


@dataclass(frozen=True, kw_only=True)
class Hooks:
    """What is called on the way.

    Attributes:
        metrics: takes the numbers of a step; called on the first rank.
        sample: draws pictures after a step; called on every rank.
        evaluate: measures held-out clips after a step; called on every rank.
        progress: takes the number of steps done, on the first rank.
        must_stop: asked after every step whether to save and end now; on every rank, and one is enough.
    """

    metrics: MetricsWriter
    sample: Callable[[int], None]
    progress: Callable[[int], None]
    must_stop: Callable[[], bool]
    evaluate: Callable[[int], None] = lambda _step: None


@dataclass(frozen=True, kw_only=True)
class TrainingRun:
    """What a run trains, and where it keeps it.

    Attributes:
        model: on its device, sharded if there are several ranks; all its parameters are kept.
        optimiser: of its parameters.
        folder: of the checkpoints.
        identity: what the run is made from; checkpoints of another are refused by it.
        average: of the weights, where one is kept.
    """

    model: nn.Module
    optimiser: torch.optim.Optimizer
    folder: Path
    identity: Mapping[str, object]
    average: WeightAverage | None = None

    @property
    def averaged_weights(self) -> Mapping[str, Tensor]:
        """Averaged weights by name; nothing where none are kept."""
        return NOTHING if self.average is None else self.average.weights


def total_steps(config: LoopConfig, loader: BatchSource[object]) -> int:
    """Optimiser steps of a run."""
    return config.max_steps or config.epochs * loader.steps


def resume(run: TrainingRun, loader: BatchSource[object]) -> int:
    """Go to the latest checkpoint, if there is one; returns the steps done.

    Raises:
        ConfigError: it belongs to another run.
        IntegrityError: it is damaged.
    """
    found = checkpoints(run.folder)
    if not found:
        return 0
    state = load_checkpoint(found[-1], run.model, run.optimiser, run.identity, run.averaged_weights)
    loader.load_state_dict(dict(state.loader))
    return state.step


def train(
    run: TrainingRun,
    step: Callable[[BatchT], StepResult],
    loader: BatchSource[BatchT],
    config: LoopConfig,
    *,
    hooks: Hooks,
    done: int,
) -> None:
    """Take steps until the schedule ends.

    Args:
        run: what is trained.
        step: takes one step of the optimiser on this rank's share of a global batch.
        loader: of this rank.
        config: how long, and how often.
        hooks: metrics, pictures and progress.
        done: steps done before.

    Raises:
        NumericalError: of `step`; no checkpoint is written then.
        Preempted: it had to stop before the schedule ended, and a checkpoint says where.
    """
    steps = total_steps(config, loader)
    rank, _ = rank_and_world_size()
    while done < steps:
        for waited_s, batch in _timed(loader):
            started_s = time.perf_counter()
            rate = learning_rate(done, steps, config.optimiser)
            set_learning_rate(run.optimiser, rate)
            result = step(batch)
            done += 1
            if run.average is not None:
                follow(run.average, run.model, done)
            is_last = done == steps
            if rank == 0:
                hooks.progress(done)
                if done % config.log_every == 0 or is_last:
                    hooks.metrics(done, _told(result, rate, time.perf_counter() - started_s, waited_s))
            if config.sample_every and done % config.sample_every == 0:
                hooks.sample(done)
            if config.evaluate_every and done % config.evaluate_every == 0:
                hooks.evaluate(done)
            stops = any_rank(hooks.must_stop())
            if done % config.checkpoint_every == 0 or is_last or stops:
                path = save_checkpoint(
                    run.folder,
                    run.model,
                    run.optimiser,
                    TrainingState(step=done, loader=loader.state_dict(), identity=run.identity),
                    run.averaged_weights,
                )
                if rank == 0:
                    drop_old_checkpoints(run.folder, config.keep_checkpoints)
            if is_last:
                break
            if stops:
                raise Preempted(f"told to end (SIGTERM): {path} holds step {done}; run the same command again to go on")


def _told(result: StepResult, rate: float, seconds: float, waited_s: float) -> dict[str, float]:
    """What is told of a step; its speed is that of step and wait together."""
    return {
        **result.losses,
        "gradient_norm": result.gradient_norm,
        "learning_rate": rate,
        "seconds": seconds,
        "data_wait_seconds": waited_s,
        **({} if result.work is None else speed(result.work, seconds + waited_s)),
        "peak_memory_gib": peak_memory_gib(),
    }


def _timed(loader: BatchSource[BatchT]) -> Iterator[tuple[float, BatchT]]:
    """Batches, each with the seconds that it was waited for."""
    asked_s = time.perf_counter()
    for batch in loader:
        yield time.perf_counter() - asked_s, batch
        asked_s = time.perf_counter()


def finish_step(
    run: TrainingRun, losses: Mapping[str, float], clip_norm: float, blame: Callable[[str], str]
) -> StepResult:
    """Clip the gradients that were gathered and step the optimiser, if all is finite.

    Args:
        run: what is trained.
        losses: over all ranks.
        clip_norm: largest norm of the gradient.
        blame: says of which data the step was, given what is not finite.

    Raises:
        NumericalError: a loss or the gradient is not finite.
    """
    norm = float(whole(clip_grad_norm_(run.model.parameters(), clip_norm)))
    wrong = [name for name, value in losses.items() if not math.isfinite(value)]
    if wrong or not math.isfinite(norm):
        raise NumericalError(blame(", ".join(wrong) or f"gradient norm {norm}"))
    run.optimiser.step()
    return StepResult(losses=losses, gradient_norm=norm)
