"""From a block of memory to a batch where the model wants it: on the processor as it is, on a GPU beside its work."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import torch

from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import LATENT_DTYPES, Batch, BatchBlock
from wsm_data.loaders.batches.standardise import Standardisation, standardisations
from wsm_data.loaders.config import ReadConfig
from wsm_data.schema.sequence import NO_SEQUENCE
from wsm_data.shards.manifest import ReleaseManifest


def device_of(read: ReadConfig) -> torch.device:
    """Where batches are delivered.

    Raises:
        ConfigError: it is neither the processor nor a CUDA device that is there.
    """
    try:
        device = torch.device(read.device)
    except RuntimeError as error:
        raise ConfigError(f"device must be 'cpu' or a CUDA device, found {read.device!r}: {error}") from error
    if device.type not in ("cpu", "cuda"):
        raise ConfigError(f"device must be 'cpu' or a CUDA device, found {read.device!r}; move batches there yourself")
    if device.type == "cuda" and not torch.cuda.is_available():
        raise ConfigError(f"device = {read.device!r} needs CUDA, and torch finds none; set device to 'cpu'")
    return device


def open_transfer(read: ReadConfig, manifest: ReleaseManifest, *, depth: bool = True) -> Callable[[BatchBlock], Batch]:
    """What makes batches of blocks, to be called where blocks are read; latents must come as they are stored for a GPU.

    Raises:
        ConfigError: the device is not there.
    """
    device = device_of(read)
    return BatchBlock.batch if device.type == "cpu" else CudaTransfer(device, read, manifest, depth=depth)


class CudaTransfer:
    """Copies blocks to a GPU on a stream of its own and standardises them there.

    Page-locked blocks (`pin_memory`) are copied while the GPU computes. The calling thread waits for the copy, so the
    block may be used again when its batch is delivered.
    """

    def __init__(self, device: torch.device, read: ReadConfig, manifest: ReleaseManifest, *, depth: bool = True):
        self._device, self._dtype = device, LATENT_DTYPES[read.dtype]
        self._standardise = standardisations(manifest, depth=depth, standard=read.standard) if read.standardise else {}
        self._stream = torch.cuda.Stream(device)

    def __call__(self, block: BatchBlock) -> Batch:
        """Copy and standardise a batch; its tensors are complete when this returns."""
        with torch.cuda.stream(self._stream):
            batch = on_device(block, self._device, self._dtype, self._standardise)
            done = torch.cuda.Event(blocking=True)
            done.record(self._stream)
        done.synchronize()
        return batch


def on_device(
    block: BatchBlock, device: torch.device, dtype: torch.dtype, standardise: Mapping[str, Standardisation]
) -> Batch:
    """The batch on a device, its latents standardised there.

    Args:
        block: a batch with latents as they are stored.
        device: where it goes.
        dtype: dtype of the latents.
        standardise: mean and scale of `rgb` and `depth`; without them, only the dtype changes. Padding stays zero.
    """
    batch = replace(block, memory=block.memory.to(device, non_blocking=True)).batch()

    padding = (batch.sequence_id == NO_SEQUENCE)[..., None, None, None]

    def finished(name: str, latents: torch.Tensor) -> torch.Tensor:
        if name not in standardise:
            return latents.to(dtype)
        return standardise[name].whole(latents, dtype).masked_fill_(padding, 0)

    depth = None if batch.depth is None else finished("depth", batch.depth)
    return replace(batch, rgb=finished("rgb", batch.rgb), depth=depth)


def hand_over(batch: Batch) -> Batch:
    """Give a batch to the thread that trains: what its stream still uses is not reused on another."""
    if batch.rgb.is_cuda:
        for tensor in (batch.rgb, batch.depth, batch.poses):  # the last one stands for the block
            if tensor is not None:
                tensor.record_stream(torch.cuda.current_stream(tensor.device))
    return batch
