"""By which numbers latents are standardised before a model sees them: said once, of a release or of a model."""

from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float32Array


@dataclass(frozen=True, kw_only=True)
class LatentStandard:
    """Mean and standard deviation of each channel of RGB and depth latents, and the codec that they belong to.

    Standardised latents are (x - mean) / std.

    Attributes:
        codec: name of the codec.
        codec_digest: digest of its settings and weights.
        rgb_mean: of RGB latents.
        rgb_std: of RGB latents.
        depth_mean: of depth latents.
        depth_std: of depth latents.
    """

    codec: str
    codec_digest: str
    rgb_mean: tuple[float, ...]
    rgb_std: tuple[float, ...]
    depth_mean: tuple[float, ...]
    depth_std: tuple[float, ...]

    def raw_rgb(self, latents: Float32Array) -> Float32Array:
        """Standardised RGB latents [..., C, h, w] as their codec decodes them."""
        return _raw(latents, self.rgb_mean, self.rgb_std)

    def raw_depth(self, latents: Float32Array) -> Float32Array:
        """Standardised depth latents [..., C, h, w] as their codec decodes them."""
        return _raw(latents, self.depth_mean, self.depth_std)


def _raw(latents: Float32Array, mean: tuple[float, ...], std: tuple[float, ...]) -> Float32Array:
    scale, offset = (np.array(values, np.float32)[:, None, None] for values in (std, mean))
    return latents * scale + offset
