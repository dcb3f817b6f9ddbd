"""The flow-matching error of RGB latents, weighted by a bell over the flow time (paper, appendix A.1)."""

from functools import cache

import torch
from torch import Tensor

from wsm_model.flow import shifted_flow_time

GRID_POINTS = 1000
"""Timesteps of Wan2.2's schedule, over which the weight has mean 1."""


@cache
def _bell_constants(shift: float) -> tuple[float, float]:
    """Minimum of the bell over the shifted grid, and the factor that makes its mean 1 there; float64."""
    grid = shifted_flow_time(torch.arange(1, GRID_POINTS + 1, dtype=torch.float64) / GRID_POINTS, shift)
    bell = torch.exp(-2 * (grid - 0.5) ** 2)
    lowest = float(bell.min())
    return lowest, 1 / float((bell - lowest).mean())


def flow_weight(flow_time: Tensor, shift: float) -> Tensor:
    """exp(-2 (tau - 1/2)^2) minus its minimum, with mean 1 over the shifted grid of 1000 timesteps.

    The paper says "a bell-shaped function of tau"; this one is the weight of Wan2.2's training schedule (paper silent).
    With a shift of 5 it is about 2.08 at 1/2 and 0 at 1.
    """
    lowest, factor = _bell_constants(shift)
    return (torch.exp(-2 * (flow_time - 0.5) ** 2) - lowest).clamp(min=0) * factor


def flow_errors(velocity: Tensor, clean: Tensor, noise: Tensor, flow_time: Tensor, shift: float) -> Tensor:
    """Weighted squared error of the velocity eps - x, as the mean over the values of each latent frame.

    Args:
        velocity: predictions [B, F, C, h, w].
        clean: x, the same shape.
        noise: eps, the same shape.
        flow_time: tau of each frame, [B, F].
        shift: gamma.

    Returns:
        float32 [B, F].
    """
    squared = (velocity.float() - (noise - clean).float()).square().flatten(2).mean(-1)
    return squared * flow_weight(flow_time.float(), shift)
