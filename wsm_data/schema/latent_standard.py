"""By which numbers latents are standardised before a model sees them: said once, of a release or of a model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wsm_data.schema.arrays import Float32Array


@dataclass(frozen=True, kw_only=True)
class LatentStandard:
    """Mean and standard deviation of each channel of RGB and depth latents, and the codec that they belong to.

    Standardised latents are (x - mean) / std.

    Attributes:
        codec: name of the codec.
        codec_digest: digest of its settings and weights.
        rgb_mean: of RGB latents.
        rgb_std: what RGB latents are divided by: their deviations, or what the codec makes of them (`channel_scales`).
        depth_mean: of depth latents; empty where there is no depth.
        depth_std: what depth latents are divided by; likewise.
    """

    codec: str
    codec_digest: str
    rgb_mean: tuple[float, ...]
    rgb_std: tuple[float, ...]
    depth_mean: tuple[float, ...]
    depth_std: tuple[float, ...]

    def standard_rgb(self, latents: Float32Array) -> Float32Array:
        """RGB latents [..., C, h, w] of the codec, standardised: to the bit what a loader delivers of a release."""
        mean, scale = _column(self.rgb_mean), _column(1 / np.array(self.rgb_std, np.float64))
        return (latents - mean) * scale

    def raw_rgb(self, latents: Float32Array) -> Float32Array:
        """Standardised RGB latents [..., C, h, w] as their codec decodes them."""
        return _raw(latents, self.rgb_mean, self.rgb_std)

    def raw_depth(self, latents: Float32Array) -> Float32Array:
        """Standardised depth latents [..., C, h, w] as their codec decodes them."""
        return _raw(latents, self.depth_mean, self.depth_std)


def _raw(latents: Float32Array, mean: tuple[float, ...], std: tuple[float, ...]) -> Float32Array:
    return latents * _column(std) + _column(mean)


def _column(values: ArrayLike) -> Float32Array:
    return np.array(values, np.float32)[:, None, None]
