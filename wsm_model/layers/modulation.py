"""The float32 islands of a layer: norm, shift and scale, and the gated residual (Wan2.2)."""

import torch
from torch import Tensor
from torch.nn import functional


def modulated_norm(x: Tensor, shift: Tensor, scale: Tensor, eps: float) -> Tensor:
    """LayerNorm without parameters, times 1 + scale, plus shift; computed in float32, returned in the dtype of x.

    Args:
        x: tokens [..., D].
        shift: broadcasts to x.
        scale: broadcasts to x.
        eps: added to the variance.
    """
    with torch.autocast(x.device.type, enabled=False):
        normed = functional.layer_norm(x.float(), (x.shape[-1],), eps=eps)
        return (normed * (1 + scale) + shift).to(x.dtype)


def gated_sum(x: Tensor, change: Tensor, gate: Tensor) -> Tensor:
    """Residual sum x + change * gate in float32, returned in the dtype of x."""
    with torch.autocast(x.device.type, enabled=False):
        return (x.float() + change.float() * gate).to(x.dtype)
