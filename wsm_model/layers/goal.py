"""The goal, a point in the first camera's frame, as the one token that the generation expert attends to.

The paper embeds the goal as a token for cross-attention and says no more; Fourier features and a two-layer network are
decided here. Attention over a single key gives that key's value whatever the query is: the goal enters each layer as a
learned bias of the noisy RGB tokens, and is computed as such (`OneTokenAttention`).
"""

import torch
from torch import Tensor, nn
from torch.nn import functional


def fourier_features(points_m: Tensor, frequencies: int, base_rad_per_m: float) -> Tensor:
    """The coordinates, then sine and cosine of each at doubling frequencies.

    Args:
        points_m: [..., 3], m.
        frequencies: n; angles are coordinate * base * 2^k for k = 0 .. n - 1.
        base_rad_per_m: lowest frequency.

    Returns:
        float32 [..., 3 + 6 n].
    """
    scales = base_rad_per_m * 2.0 ** torch.arange(frequencies, dtype=torch.float64, device=points_m.device)
    angles = (points_m.double().unsqueeze(-1) * scales).flatten(-2)
    return torch.cat([points_m.double(), angles.sin(), angles.cos()], dim=-1).float()


class GoalEmbedding(nn.Module):
    """Goal points [..., 3] to goal tokens [..., D].

    Args:
        frequencies: Fourier frequencies of a coordinate.
        base_rad_per_m: lowest of them.
        width: D.
    """

    def __init__(self, frequencies: int, base_rad_per_m: float, width: int):
        super().__init__()
        self.frequencies = frequencies
        self.base_rad_per_m = base_rad_per_m
        self.linear_1 = nn.Linear(3 + 6 * frequencies, width)
        self.linear_2 = nn.Linear(width, width)

    def forward(self, goal_camera0_m: Tensor) -> Tensor:
        """Embed goals in the first camera's frame, m."""
        features = fourier_features(goal_camera0_m, self.frequencies, self.base_rad_per_m)
        hidden = functional.gelu(self.linear_1(features.to(self.linear_1.weight.dtype)), approximate="tanh")
        return self.linear_2(hidden)
