"""Latents to patch vectors and back.

Wan2.2 flattens a patch on the way in as (channel, row, column) and on the way out as (row, column, channel); both are
kept, since the pretrained weights expect them.
"""

from torch import Tensor


def cut_patches(latents: Tensor, patch: int) -> Tensor:
    """Latents [..., C, h, w] to patch vectors [..., P, C * patch^2]: patches row by row, values as (C, row, column)."""
    x = latents.unflatten(-1, (-1, patch)).unflatten(-3, (-1, patch))  # ..., C, rows, patch, columns, patch
    lead = x.dim() - 5
    order = [*range(lead), lead + 1, lead + 3, lead, lead + 2, lead + 4]
    return x.permute(order).flatten(-3).flatten(-3, -2)


def join_patches(vectors: Tensor, patch: int, rows: int) -> Tensor:
    """Patch vectors [..., P, patch^2 * C], values as (row, column, C), to latents [..., C, h, w].

    Args:
        vectors: the head's output.
        patch: side of a patch.
        rows: rows of patches.
    """
    x = vectors.unflatten(-1, (patch, patch, -1)).unflatten(-4, (rows, -1))  # ..., rows, columns, patch, patch, C
    lead = x.dim() - 5
    order = [*range(lead), lead + 4, lead, lead + 2, lead + 1, lead + 3]
    sides = (rows * patch, x.shape[-4] * patch)
    return x.permute(order).reshape(*x.shape[:-5], x.shape[-1], *sides)
