"""Pretrained tensors at another width, as the paper initialises its depth and pose experts: by linear interpolation.

The paper says no more than that. Decided here: each dimension that differs is resized on its own, ends on ends, in
float32. Between two neighbours that are independent, as neurons are, the variance of (1 - w) a + w b is below theirs,
two thirds of it on average: matrices are scaled so that independent entries keep their variance, and by sqrt(source /
target) where the input dimension shrank, since fewer inputs are summed. So outputs keep their variance where inputs are
independent. Biases, norms and tables of modulation are interpolated as they are: what they mean is their value.
"""

import torch
from torch import Tensor
from torch.nn.functional import interpolate


def resize_dimension(tensor: Tensor, dimension: int, size: int) -> Tensor:
    """Linear interpolation along one dimension, first on first and last on last; float32."""
    moved = tensor.float().movedim(dimension, -1)
    flat = moved.reshape(-1, 1, moved.shape[-1])
    resized = interpolate(flat, size=size, mode="linear", align_corners=True)
    return resized.reshape(*moved.shape[:-1], size).movedim(-1, dimension)


def kept_variance(source: int, size: int) -> float:
    """Mean over the places of (1 - w)^2 + w^2: what interpolation leaves of the variance of independent entries."""
    places = torch.linspace(0, source - 1, size, dtype=torch.float64)
    share = places - places.floor()
    return float(((1 - share).square() + share.square()).mean())


def resize_tensor(tensor: Tensor, shape: tuple[int, ...], input_dimension: int | None) -> Tensor:
    """Resize every dimension that differs, one after another.

    Args:
        tensor: the pretrained tensor.
        shape: the wanted shape, of as many dimensions.
        input_dimension: the dimension that a matrix sums over; None for biases, norms and tables, which are not scaled.

    Raises:
        ValueError: the numbers of dimensions differ.
    """
    if tensor.dim() != len(shape):
        raise ValueError(f"a tensor of shape {tuple(tensor.shape)} cannot be resized to {shape}")
    resized = tensor.float()
    for dimension, size in enumerate(shape):
        if resized.shape[dimension] != size:
            if input_dimension is not None:
                resized = resized / kept_variance(resized.shape[dimension], size) ** 0.5
            resized = resize_dimension(resized, dimension, size)
    if input_dimension is not None and shape[input_dimension] < tensor.shape[input_dimension]:
        resized = resized * (tensor.shape[input_dimension] / shape[input_dimension]) ** 0.5
    return resized
