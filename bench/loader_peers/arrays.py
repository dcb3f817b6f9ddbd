"""The clips that every contestant stores and delivers, and the check that it delivered them."""

from collections.abc import Iterator, Mapping

import numpy as np
import torch
import xxhash

CLIPS = 300
BATCH = 8
LATENTS = 44
FRAMES = 1 + 4 * (LATENTS - 1)
CHANNELS, ROWS, COLUMNS = 48, 12, 20
NAMES = ("rgb_latent", "depth_latent", "depth_valid", "poses")
SHAPES = {
    "rgb_latent": (LATENTS, CHANNELS, ROWS, COLUMNS),
    "depth_latent": (LATENTS, CHANNELS, ROWS, COLUMNS),
    "depth_valid": (LATENTS, ROWS, COLUMNS),
    "poses": (FRAMES, 7),
}
DTYPES = {"rgb_latent": "float16", "depth_latent": "float16", "depth_valid": "uint8", "poses": "float32"}
CLIP_BYTES = sum(int(np.prod(SHAPES[name])) * np.dtype(DTYPES[name]).itemsize for name in NAMES)

Arrays = dict[str, np.ndarray]
Batch = Mapping[str, torch.Tensor]
"""Tensors by name of array, with the clips along the first axis."""


def clip_arrays(number: int) -> Arrays:
    """Arrays of one clip, a function of its number alone; the camera stands at x = number m from frame 1 on."""
    rng = np.random.default_rng([7, number])
    latents = {
        name: rng.standard_normal(SHAPES[name], np.float32).astype(np.float16)
        for name in ("rgb_latent", "depth_latent")
    }
    poses = np.zeros(SHAPES["poses"], np.float32)
    poses[:, 3] = 1
    poses[1:, 0] = number
    poses[1:, 1:3] = rng.standard_normal((FRAMES - 1, 2), np.float32)
    return {**latents, "depth_valid": rng.integers(0, 256, SHAPES["depth_valid"], np.uint8), "poses": poses}


def all_clips() -> Iterator[Arrays]:
    return map(clip_arrays, range(CLIPS))


def digest(arrays: Mapping[str, np.ndarray]) -> str:
    """xxh3 of the four arrays, dtypes and shapes included."""
    hasher = xxhash.xxh3_64()
    for name in NAMES:
        array = np.ascontiguousarray(arrays[name])
        hasher.update(f"{name} {array.dtype} {array.shape} ".encode())
        hasher.update(array.reshape(-1).view(np.uint8))
    return hasher.hexdigest()


def numbers(batch: Batch) -> list[int]:
    """Numbers of the clips of a batch, read from their poses."""
    return [int(x) for x in batch["poses"][:, 1, 0].tolist()]


def digests(batch: Batch) -> dict[int, str]:
    """Digest of every clip of a batch, by its number."""
    arrays = {name: batch[name].numpy() for name in NAMES}
    return {
        number: digest({name: array[row] for name, array in arrays.items()})
        for row, number in enumerate(numbers(batch))
    }


def byte_count(batch: Batch) -> int:
    """Bytes of the tensors; what libraries add to a batch, such as keys, is not counted."""
    return sum(value.nbytes for value in batch.values() if isinstance(value, torch.Tensor))
