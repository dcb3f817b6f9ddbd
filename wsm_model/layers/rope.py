"""Rotary positions over time, height and width, evaluated at any real position.

Wan2.2 splits a head into 44 / 42 / 42 values for t / h / w, gives each axis its own denominator in the exponent, and
rotates interleaved pairs (2i, 2i + 1). Pose slots stand between latents and outside the image, so positions may be
fractions and negative: angles are computed, not looked up.

Shape suffixes: B batch, F latent frames, P tokens of a frame, H heads, d width of a head.
"""

import torch
from torch import Tensor

from wsm_model.config import Expert, ModelConfig


def axis_widths(head_width: int) -> tuple[int, int, int]:
    """How many values of a head turn with t, h and w: 44, 42, 42 of 128."""
    of_image = 2 * (head_width // 6)
    return head_width - 2 * of_image, of_image, of_image


def rotary_angles(positions: Tensor, head_width: int, theta: float) -> Tensor:
    """Angles of the pairs of a head.

    Args:
        positions: t, h, w of each token, float64 [..., 3].
        head_width: d.
        theta: base of the frequencies.

    Returns:
        Angles in radians, float64 [..., d / 2]: those of t first, then h, then w.
    """
    angles = []
    for axis, width in enumerate(axis_widths(head_width)):
        exponents = torch.arange(0, width, 2, dtype=torch.float64, device=positions.device) / width
        angles.append(positions[..., axis, None] * theta**-exponents)
    return torch.cat(angles, dim=-1)


def rotary_tables(positions: Tensor, head_width: int, theta: float) -> tuple[Tensor, Tensor]:
    """Cosine and sine of `rotary_angles`, computed in float64 and rounded to float32 [..., d / 2]."""
    angles = rotary_angles(positions.double(), head_width, theta)
    return angles.cos().float(), angles.sin().float()


def rotate(x_BFPHd: Tensor, tables: tuple[Tensor, Tensor]) -> Tensor:
    """Turn the pairs (2i, 2i + 1) of queries or keys.

    Args:
        x_BFPHd: queries or keys [..., P, H, d].
        tables: cosine and sine, float32 [..., P, d / 2], the same for every head.

    Returns:
        The same shape and dtype; computed in float32.
    """
    cos, sin = (table.unsqueeze(-2) for table in tables)
    even, odd = x_BFPHd.float().unflatten(-1, (-1, 2)).unbind(-1)
    turned = torch.stack([even * cos - odd * sin, even * sin + odd * cos], dim=-1)
    return turned.flatten(-2).to(x_BFPHd.dtype)


def token_offsets(config: ModelConfig, expert: Expert) -> Tensor:
    """Positions of the tokens of latent 0, relative to its time: float64 [P, 3].

    RGB and depth patches stand at (0, row, column). Pose slot m = 1..M stands at t = -(M - m) / M, h = w = -1: the last
    slot shares the time of its latent (paper silent).
    """
    if expert is Expert.POSE:
        slots = torch.arange(1, config.pose_slots + 1, dtype=torch.float64)
        times = -(config.pose_slots - slots) / config.pose_slots
        return torch.stack([times, -torch.ones_like(times), -torch.ones_like(times)], dim=-1)
    rows = torch.arange(config.latent_height // config.patch, dtype=torch.float64)
    columns = torch.arange(config.latent_width // config.patch, dtype=torch.float64)
    grid = torch.cartesian_prod(rows, columns)
    return torch.cat([torch.zeros(len(grid), 1, dtype=torch.float64), grid], dim=-1)


def frame_positions(latent_index_BF: Tensor, offsets_P3: Tensor) -> Tensor:
    """Positions of all tokens, float64 [B, F, P, 3]: the number of the latent in its sequence is its time."""
    time = torch.zeros(*latent_index_BF.shape, 1, 3, dtype=torch.float64, device=latent_index_BF.device)
    time[..., 0] = latent_index_BF.unsqueeze(-1)
    return time + offsets_P3.to(time.device)
