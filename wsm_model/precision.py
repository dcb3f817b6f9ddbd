"""Arithmetic of the matrix products, and the weights they take.

Under autocast to bfloat16 each product rounds its weights anew. In use, where weights do not change, they may as well
be stored so: half the memory, and what comes out is the same to the bit.
"""

from enum import StrEnum

import torch
from torch import nn

from wsm_model.layers.pose import PoseEmbedding, PoseHead
from wsm_model.layers.time_embedding import TimeEmbedding

_FLOAT32 = (TimeEmbedding, PoseEmbedding, PoseHead)
"""What computes in float32 under autocast too."""


class Precision(StrEnum):
    """Arithmetic of the matrix products; norms, modulation, residual sums and losses are float32 in either."""

    BFLOAT16 = "bfloat16"
    FLOAT32 = "float32"


def autocast(precision: Precision, device: torch.device) -> torch.autocast:
    """Matrix products in this precision.

    Rounded weights are not cached: each is used once in a pass, and a cache would hold a copy of the whole model where
    layers are recomputed or sharded.
    """
    is_rounded = precision is Precision.BFLOAT16
    return torch.autocast(device.type, torch.bfloat16, enabled=is_rounded, cache_enabled=False)


def stored_precision(model: nn.Module) -> Precision:
    """How a model's matrices are stored, which decides how it must be run."""
    is_rounded = any(parameter.dtype == torch.bfloat16 for parameter in model.parameters())
    return Precision.BFLOAT16 if is_rounded else Precision.FLOAT32


def matrices(model: nn.Module) -> set[str]:
    """Names of the parameters that autocast rounds: those of all linear layers but what computes in float32."""
    exact = {part for module in model.modules() if isinstance(module, _FLOAT32) for part in module.modules()}
    return {
        f"{name}.{part}"
        for name, module in model.named_modules()
        if isinstance(module, nn.Linear) and module not in exact
        for part, _ in module.named_parameters(recurse=False)
    }
