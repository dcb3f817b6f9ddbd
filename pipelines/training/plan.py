"""What a run would take on the hardware it is planned for, before anything is paid for."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from pipelines.training.config import TrainRunConfig
from wsm_data.errors import ConfigError
from wsm_data.loaders.loader import ClipLoader
from wsm_data.view.drawing.text_table import aligned
from wsm_model.config import ModelConfig
from wsm_model.training.budget import memory_bytes, model_cost, step_flop
from wsm_model.training.loop import total_steps

_GIB = 2.0**30


@dataclass(frozen=True, kw_only=True)
class TrainingPlan:
    """What a run takes.

    Attributes:
        memory: bytes of a rank by part.
        latents: that are passed at once on a rank, at most.
        flop: of a step.
        seconds: of a step, at the efficiency that is planned with.
        steps: of the run.
    """

    memory: dict[str, float]
    latents: int
    flop: float
    seconds: float
    steps: int


def training_plan(config: TrainRunConfig, shape: ModelConfig, loader: ClipLoader) -> TrainingPlan:
    """Calculate what a run takes; no clip is read."""
    hardware, training, order = config.hardware, config.training, config.order
    latents = np.concatenate([table.column("latents") for table in loader.sources.tables])
    lengths = np.minimum(latents, order.max_latents or latents.max())
    rows = -(-order.global_batch // hardware.gpus)
    at_once = min(rows, training.micro_rows or rows) * int(order.row_latents or lengths.max())
    cost = model_cost(shape, training.precision)
    is_recomputed = training.checkpoint_activations
    clips_a_step = loader.sources.clips / max(1, loader.steps)
    shares = {length: count * clips_a_step / len(lengths) for length, count in Counter(lengths.tolist()).items()}
    flop = step_flop(shape, cost, shares, is_recomputed=is_recomputed)
    return TrainingPlan(
        memory=memory_bytes(shape, cost, hardware, training.precision, latents=at_once, is_recomputed=is_recomputed),
        latents=at_once,
        flop=flop,
        seconds=flop / (hardware.gpus * hardware.peak_tflops * 1e12 * hardware.efficiency),
        steps=total_steps(training, loader),
    )


def plan_text(plan: TrainingPlan, config: TrainRunConfig) -> str:
    """The plan as a table and two lines."""
    hardware = config.hardware
    rows = [[part, f"{size / _GIB:.2f}"] for part, size in plan.memory.items()]
    total = sum(plan.memory.values()) / _GIB
    days = plan.steps * plan.seconds / 86400
    return "\n".join(
        [
            aligned(
                [
                    [f"memory of one of {hardware.gpus} GPUs", "GiB"],
                    *rows,
                    [f"sum, of {hardware.memory_gib:g}", f"{total:.2f}"],
                ]
            ),
            f"a step: {plan.flop / 1e12:,.1f} TFLOP, {plan.seconds:.2f} s at {hardware.efficiency:.0%} of "
            f"{hardware.gpus} x {hardware.peak_tflops:g} TFLOP/s",
            f"in all: {days:.2f} days, {days * 24 * hardware.gpus:,.0f} GPU hours",
        ]
    )


def require_fit(plan: TrainingPlan, config: TrainRunConfig) -> None:
    """Check that a rank has the memory.

    Raises:
        ConfigError: by calculation it has not; says what may help.
    """
    total, limit = sum(plan.memory.values()) / _GIB, config.hardware.memory_gib
    if total > limit:
        largest = max(plan.memory, key=plan.memory.__getitem__)
        raise ConfigError(
            f"a GPU of {limit:g} GiB (hardware.memory_gib) must hold the {total:.1f} GiB of a rank by calculation; "
            f"most is {largest!r}. Recompute layers (training.checkpoint_activations), pass fewer rows at once than "
            f"{plan.latents} latents (training.micro_rows, order.max_latents), or plan for more GPUs (hardware.gpus); "
            "--anyway prints the plan regardless"
        )
