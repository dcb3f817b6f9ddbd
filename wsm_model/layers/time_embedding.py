"""Timesteps on the 0..1000 scale to the vectors that modulate every layer of an expert.

Each expert embeds time on its own. Values are computed once per place of the time tensor, which is a copy of a frame,
and not per token: six vectors of full width per token would be the largest tensors of the model.

Shape suffixes: D width of the expert.
"""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

MODULATIONS = 6
"""shift, scale, gate of the self-attention, then shift, scale, gate of the feed-forward network (Wan2.2)."""

_LONGEST_PERIOD = 10000.0


def sinusoid(time: Tensor, width: int) -> Tensor:
    """Cosines, then sines, of a timestep: float32 [..., width] of time [...], computed in float64."""
    half = width // 2
    exponents = torch.arange(half, dtype=torch.float64, device=time.device) / half
    angles = time.double().unsqueeze(-1) * torch.exp(-math.log(_LONGEST_PERIOD) * exponents)
    return torch.cat([angles.cos(), angles.sin()], dim=-1).float()


class TimeEmbedding(nn.Module):
    """e = Linear(SiLU(Linear(sinusoid))), and the six modulation vectors Linear(SiLU(e)); in float32.

    Args:
        frequencies: width of the sinusoid.
        width: D.
    """

    def __init__(self, frequencies: int, width: int):
        super().__init__()
        self.frequencies = frequencies
        self.linear_1 = nn.Linear(frequencies, width)
        self.linear_2 = nn.Linear(width, width)
        self.projection = nn.Linear(width, MODULATIONS * width)

    def forward(self, time: Tensor) -> tuple[Tensor, Tensor]:
        """Embed timesteps [...] to e [..., D] and modulations [..., 6, D], both float32."""
        with torch.autocast(time.device.type, enabled=False):
            x = sinusoid(time, self.frequencies).to(self.linear_1.weight.dtype)
            embedded = self.linear_2(functional.silu(self.linear_1(x)))
            modulation = self.projection(functional.silu(embedded)).unflatten(-1, (MODULATIONS, -1))
        return embedded.float(), modulation.float()
