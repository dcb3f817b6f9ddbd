"""A batch: what it is for the model, and how it lies in one block of memory.

All tensors of a batch are views of one block, so that it crosses to a device as a whole, and its
memory is used again as a whole.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from types import MappingProxyType
from typing import TypeAlias

import torch

from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.pose import POSE_VALUES
from wsm_data.schema.sequence import POSE_SLOTS, SequenceSpan

Batch: TypeAlias = ClipBatch[torch.Tensor]

LATENT_TENSORS = ("rgb", "depth")
"""Tensors of a batch that hold latents."""

_ALIGNMENT_BYTES = 64

LATENT_DTYPES: Mapping[str, torch.dtype] = {
    "float32": torch.float32,
    "bfloat16": torch.bfloat16,
    "float16": torch.float16,
}
"""Dtypes that the latents of a batch can have."""


@dataclass(frozen=True, kw_only=True)
class TensorPlace:
    """Where a tensor lies in the block of its batch.

    Attributes:
        offset: first byte, a multiple of 64.
        dtype: its dtype.
        shape: its shape.
        strides: of each axis in C order, in elements.
    """

    offset: int
    dtype: torch.dtype
    shape: tuple[int, ...]
    strides: tuple[int, ...]

    @property
    def end(self) -> int:
        """First byte behind the tensor."""
        return self.offset + prod(self.shape) * self.dtype.itemsize


@dataclass(frozen=True, kw_only=True)
class BatchLayout:
    """Sizes that decide where each tensor of a batch lies.

    Attributes:
        rows: R.
        row_latents: L.
        sequences: N.
        latent_shape: channels, height and width of a latent.
        dtype: dtype of the latents.
        depth: whether there is depth.
    """

    rows: int
    row_latents: int
    sequences: int
    latent_shape: tuple[int, int, int]
    dtype: torch.dtype
    depth: bool

    @cached_property
    def tensors(self) -> Mapping[str, TensorPlace]:
        """Place of each tensor of `Batch`, by name."""
        latents, (_, height, width) = (self.rows, self.row_latents), self.latent_shape
        shapes: dict[str, tuple[torch.dtype, tuple[int, ...]]] = {
            "rgb": (self.dtype, (*latents, *self.latent_shape)),
            "depth": (self.dtype, (*latents, *self.latent_shape)),
            "depth_valid": (torch.uint8, (*latents, height, width)),
            "poses": (torch.float32, (*latents, POSE_SLOTS, POSE_VALUES)),
            "still": (torch.bool, (*latents, POSE_SLOTS)),
            "sequence_id": (torch.int32, latents),
            "latent_index": (torch.int32, latents),
            "goal_camera0_m": (torch.float32, (self.sequences, 3)),
        }
        if not self.depth:
            del shapes["depth"], shapes["depth_valid"]
        places: dict[str, TensorPlace] = {}
        offset = 0
        for name, (dtype, shape) in shapes.items():
            strides = tuple(prod(shape[axis + 1 :]) for axis in range(len(shape)))
            places[name] = TensorPlace(offset=offset, dtype=dtype, shape=shape, strides=strides)
            offset = _aligned(places[name].end)
        return MappingProxyType(places)

    @cached_property
    def strides_bytes(self) -> Mapping[str, tuple[int, int, int]]:
        """Of each tensor that has latents: its first byte, and bytes from row to row and from latent to latent."""
        found = {}
        for name, place in self.tensors.items():
            if len(place.shape) > 1:
                of_row, of_latent = (stride * place.dtype.itemsize for stride in place.strides[:2])
                found[name] = (place.offset, of_row, of_latent)
        return found

    @property
    def size_bytes(self) -> int:
        """Bytes of the block that holds all tensors, a multiple of 64."""
        return _aligned(max(place.end for place in self.tensors.values()))


@lru_cache(maxsize=64)
def layout_of(
    rows: int,
    row_latents: int,
    sequences: int,
    latent_shape: tuple[int, int, int],
    dtype: torch.dtype,
    *,
    depth: bool = True,
) -> BatchLayout:
    """The layout of these sizes; most batches of a run share one."""
    return BatchLayout(
        rows=rows, row_latents=row_latents, sequences=sequences, latent_shape=latent_shape, dtype=dtype, depth=depth
    )


def _aligned(offset: int) -> int:
    return -(-offset // _ALIGNMENT_BYTES) * _ALIGNMENT_BYTES


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchBlock:
    """A batch as one block of memory.

    Attributes:
        memory: the block; uint8 [layout.size_bytes], on any device.
        layout: where each tensor lies in it.
        spans: where each sequence lies in the batch.
        refs: numbers of the clips; int64 [N].
        keys: keys of the clips.
        epoch: number of the epoch.
        step: number of the global step in the epoch.
    """

    memory: torch.Tensor
    layout: BatchLayout
    spans: tuple[SequenceSpan, ...]
    refs: Int64Array
    keys: tuple[str, ...]
    epoch: int
    step: int

    @cached_property
    def bytes(self) -> memoryview:
        """The block as bytes; on the processor only."""
        return memoryview(self.memory.numpy())

    @cached_property
    def tensors(self) -> dict[str, torch.Tensor]:
        """The tensors of the batch by name, as views of the block."""
        places = self.layout.tensors
        wholes = {dtype: self.memory.view(dtype) for dtype in {place.dtype for place in places.values()}}
        return {
            name: wholes[place.dtype].as_strided(place.shape, place.strides, place.offset // place.dtype.itemsize)
            for name, place in places.items()
        }

    def batch(self) -> Batch:
        """The batch itself; all tensors are views of the block."""
        return Batch(**self.tensors, spans=self.spans, refs=self.refs, keys=self.keys, epoch=self.epoch, step=self.step)
