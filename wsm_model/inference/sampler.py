"""Euler steps along the flow, from noise to RGB latents.

Flow times are those of Wan2.2's scheduler: s = 1, (n - 1) / n, ..., 1 / n, shifted, then 0.
"""

from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor

from wsm_model.flow import shifted_flow_time


def flow_schedule(steps: int, shift: float) -> list[float]:
    """The flow times of the steps and the end, n + 1 numbers from 1 to 0.

    With 8 steps and a shift of 5: 1, .972, .9375, .893, .833, .75, .625, .417, 0.

    Raises:
        ValueError: there is not one step.
    """
    if steps < 1:
        raise ValueError(f"a sampler needs at least one step, found {steps}")
    uniform = torch.arange(steps, 0, -1, dtype=torch.float64) / steps
    return [*shifted_flow_time(uniform, shift).tolist(), 0.0]


def integrate(velocity: Callable[[Tensor, float], Tensor], noise: Tensor, schedule: list[float]) -> Tensor:
    """Follow dx / dtau = v from noise at tau = 1 to latents at tau = 0.

    Args:
        velocity: v of (x, tau).
        noise: x at the first flow time.
        schedule: decreasing flow times.
    """
    x = noise
    for now, after in pairwise(schedule):
        x = x + (after - now) * velocity(x, now)
    return x
