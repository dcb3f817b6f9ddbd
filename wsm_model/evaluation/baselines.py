"""Guesses that know nothing, or the last latent alone, at their best.

They are fitted to the very clips that they are measured on, which no model is.

Shape suffixes: F latents, C channels, h rows and w columns of a latent, H rows and W columns of a picture, K horizons.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array
from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_model.evaluation.decoding import Decoding
from wsm_model.losses.pose import raw_frame_poses

_MEASURED = 128
"""Of 255: depth of a cell counts where at least half of it was measured."""


@dataclass(frozen=True, kw_only=True)
class Baselines:
    """The best constant depth map, and the best linear guess from the last latent.

    Attributes:
        depth_map_m: mean of each pixel's log depth, as metres; float32 [H, W]. None for clips without depth, or without
            a pixel that counts.
        shrink: factor of each channel of the last latent, for 1, 2, ... latents ahead; [K, C].
    """

    depth_map_m: Float32Array | None
    shrink: Tensor


def fit_baselines(batches: Sequence[ClipBatch[Tensor]], decoding: Decoding, horizons: int) -> Baselines:
    """Fit both to clips: least squares in log depth, and in standardised latents."""
    has_depth = all(batch.depth is not None for batch in batches)
    depth_map_m = _constant_map(batches, decoding) if has_depth else None
    return Baselines(depth_map_m=depth_map_m, shrink=_shrink(batches, horizons))


def recorded_frames(batch: ClipBatch[Tensor], number: int) -> BoolArray:
    """Which raw frames of a clip were recorded, [T]: not still frames that were added."""
    still = batch.still[batch.spans[number].place]
    frames: Tensor = ~raw_frame_poses(still[..., None]).squeeze(-1)
    return np.asarray(frames.cpu().numpy())


def counted_depth(batch: ClipBatch[Tensor], number: int, decoding: Decoding) -> BoolArray:
    """Which pixels of a clip have a depth that counts, bool [T, H, W]: recorded, in cells that were measured."""
    ratio = decoding.codec.describe().spatial_ratio
    if batch.depth_valid is None:
        raise ValueError("depth counts where it was measured: the batch must have depth, found one without")
    cells = batch.depth_valid[batch.spans[number].place].cpu().numpy() >= _MEASURED
    frames = np.repeat(cells, [1] + [TEMPORAL_RATIO] * (len(cells) - 1), axis=0)
    pixels = frames.repeat(ratio, axis=1).repeat(ratio, axis=2)
    return np.asarray(pixels & recorded_frames(batch, number)[:, None, None])


def true_depth(batch: ClipBatch[Tensor], number: int) -> Tensor:
    """Depth latents of a clip, [F, C, h, w].

    Raises:
        ValueError: the batch was read without depth.
    """
    if batch.depth is None:
        raise ValueError("errors of states need a batch with depth, found one without")
    return batch.depth[batch.spans[number].place].float()


def _constant_map(batches: Sequence[ClipBatch[Tensor]], decoding: Decoding) -> Float32Array | None:
    total: Float64Array | float = 0.0
    pixels: Float64Array | float = 0.0
    for batch in batches:
        for number in range(len(batch.spans)):
            counts = counted_depth(batch, number, decoding)
            log_depth = np.log(decoding.depth_m(true_depth(batch, number)).astype(np.float64))
            total = total + np.where(counts, log_depth, 0.0).sum(axis=0)
            pixels = pixels + counts.sum(axis=0)
    if not np.any(pixels):
        return None
    middle = float(np.sum(total) / np.sum(pixels))  # where a pixel was never measured
    mean = np.divide(total, pixels, out=np.full(np.shape(total), middle), where=np.asarray(pixels) > 0)
    return np.exp(mean).astype(np.float32)


def _shrink(batches: Sequence[ClipBatch[Tensor]], horizons: int) -> Tensor:
    """E[x_(t + k) x_t] / E[x_t^2] of each channel."""
    channels = batches[0].rgb.shape[2]
    products, squares = torch.zeros(horizons, channels), torch.zeros(horizons, channels)
    for batch in batches:
        for span in batch.spans:
            x = batch.rgb[span.place].float().cpu()
            for ahead in range(1, min(horizons, len(x) - 1) + 1):
                products[ahead - 1] += (x[ahead:] * x[:-ahead]).sum((0, 2, 3))
                squares[ahead - 1] += x[:-ahead].square().sum((0, 2, 3))
    return products / squares.clamp(min=torch.finfo(torch.float32).tiny)
