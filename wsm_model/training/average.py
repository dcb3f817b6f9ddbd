"""An exponential moving average of the weights, which is what is measured, drawn and exported where it is kept.

The decay of step n (from 1) is min(decay, (1 + n) / (10 + n)): the average of a young run forgets the random weights
that it began with. Averages are sharded as their parameters are.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from wsm_model.ranks import own_part


@dataclass(frozen=True, kw_only=True)
class WeightAverage:
    """Averaged weights.

    Attributes:
        decay: share of the old average that a step keeps, once the run is no longer young.
        weights: by the names of the parameters.
    """

    decay: float
    weights: Mapping[str, Tensor]


def start_average(model: nn.Module, decay: float) -> WeightAverage | None:
    """An average that stands where the model stands; None for a decay of 0."""
    if not decay:
        return None
    weights = {name: parameter.detach().clone() for name, parameter in model.named_parameters()}
    return WeightAverage(decay=decay, weights=weights)


@torch.no_grad()
def follow(average: WeightAverage, model: nn.Module, step: int) -> None:
    """Move the average towards the weights after optimiser step `step`, counted from 1."""
    decay = min(average.decay, (1 + step) / (10 + step))
    for name, parameter in model.named_parameters():
        own_part(average.weights[name]).lerp_(own_part(parameter), 1 - decay)


@contextmanager
def averaged(model: nn.Module, average: WeightAverage | None) -> Iterator[None]:
    """Hold the averaged weights in the model, where there are any; afterwards both are what they were, to the bit."""
    if average is not None:
        _exchange(model, average)
    try:
        yield
    finally:
        if average is not None:
            _exchange(model, average)


@torch.no_grad()
def _exchange(model: nn.Module, average: WeightAverage) -> None:
    """One tensor after another: no more than one is there twice."""
    for name, parameter in model.named_parameters():
        here, there = own_part(parameter), own_part(average.weights[name])
        kept = here.clone()
        here.copy_(there)
        there.copy_(kept)
