"""Learning rate as a pure function of the step, and the parameter groups it applies to (paper, appendix B.1)."""

import math
from collections import defaultdict
from typing import Any

import torch
from torch import nn

from wsm_model.config import Expert
from wsm_model.mot.transformer import expert_of_parameter
from wsm_model.training.config import OptimiserConfig

_FACTOR = "learning_rate_factor"


def learning_rate(step: int, steps: int, config: OptimiserConfig) -> float:
    """Base rate of optimiser step `step` (from 0) of `steps`: linear warm-up, then a cosine to the final rate."""
    warmup = math.ceil(config.warmup_share * steps)
    if step < warmup:
        return config.learning_rate * (step + 1) / warmup
    progress = (step - warmup) / max(1, steps - 1 - warmup)
    cosine = 0.5 * (1 + math.cos(math.pi * min(1.0, progress)))
    return config.final_learning_rate + (config.learning_rate - config.final_learning_rate) * cosine


def make_optimiser(model: nn.Module, config: OptimiserConfig) -> torch.optim.AdamW:
    """AdamW with a group for each learning rate (generation expert and goal embedding, everything else) and decay.

    One kernel takes the step of many parameters, on a GPU and on a processor.
    """
    members: dict[tuple[float, float], list[nn.Parameter]] = defaultdict(list)
    for name, parameter in model.named_parameters():
        is_slower = expert_of_parameter(name) in (Expert.GENERATION, None)
        decays = config.decay_vectors or not _is_vector(name, parameter)
        key = (config.generation_factor if is_slower else 1.0, config.weight_decay if decays else 0.0)
        members[key].append(parameter)
    groups: list[dict[str, Any]] = [
        {"params": parameters, _FACTOR: factor, "weight_decay": decay}
        for (factor, decay), parameters in members.items()
    ]
    return torch.optim.AdamW(
        groups,
        lr=config.learning_rate,
        betas=(config.beta_1, config.beta_2),
        eps=config.eps,
        fused=True,
    )


def _is_vector(name: str, parameter: nn.Parameter) -> bool:
    """Whether a parameter is a norm's, a bias, or a table of modulation, which is a few vectors."""
    return parameter.dim() < 2 or name.endswith("table")


def set_learning_rate(optimiser: torch.optim.Optimizer, rate: float) -> None:
    """Give every group its multiple of the base rate."""
    for group in optimiser.param_groups:
        group["lr"] = rate * group[_FACTOR]
