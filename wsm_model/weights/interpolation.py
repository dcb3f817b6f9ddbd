"""Pretrained tensors at another width, as the paper initialises its depth and pose experts: by linear interpolation.

The paper says no more than that. Decided here: each dimension that differs is resized on its own, ends on ends, in
float32; a matrix whose input dimension shrank is scaled by sqrt(source / target), which keeps the variance of what
comes out when fewer inputs are summed.
"""

from torch import Tensor
from torch.nn.functional import interpolate


def resize_dimension(tensor: Tensor, dimension: int, size: int) -> Tensor:
    """Linear interpolation along one dimension, first on first and last on last; float32."""
    moved = tensor.float().movedim(dimension, -1)
    flat = moved.reshape(-1, 1, moved.shape[-1])
    resized = interpolate(flat, size=size, mode="linear", align_corners=True)
    return resized.reshape(*moved.shape[:-1], size).movedim(-1, dimension)


def resize_tensor(tensor: Tensor, shape: tuple[int, ...], input_dimension: int | None) -> Tensor:
    """Resize every dimension that differs, one after another.

    Args:
        tensor: the pretrained tensor.
        shape: the wanted shape, of as many dimensions.
        input_dimension: the dimension that is summed over where the tensor is applied; None for biases, norms, tables.

    Raises:
        ValueError: the numbers of dimensions differ.
    """
    if tensor.dim() != len(shape):
        raise ValueError(f"a tensor of shape {tuple(tensor.shape)} cannot be resized to {shape}")
    resized = tensor.float()
    for dimension, size in enumerate(shape):
        if resized.shape[dimension] != size:
            resized = resize_dimension(resized, dimension, size)
    if input_dimension is not None and shape[input_dimension] < tensor.shape[input_dimension]:
        resized = resized * (tensor.shape[input_dimension] / shape[input_dimension]) ** 0.5
    return resized
