"""From the standardised latents of a release to colours and metres."""

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.schema.arrays import Float32Array, Uint8Array
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.latent_standard import LatentStandard


@dataclass(frozen=True, kw_only=True)
class Decoding:
    """What turns latents of a release into pictures.

    Attributes:
        codec: of the release.
        standard: how its latents are standardised.
        depth_range: of its depth.
    """

    codec: VideoCodec
    standard: LatentStandard
    depth_range: DepthRange

    def rgb(self, latents: Tensor) -> Float32Array:
        """Standardised RGB latents [F, C, h, w] as a video in [-1, 1], float32 [T, H, W, 3]."""
        return np.clip(self.codec.decode(self.standard.raw_rgb(latents.float().cpu().numpy())), -1.0, 1.0)

    def rgb_u8(self, latents: Tensor) -> Uint8Array:
        """Standardised RGB latents [F, C, h, w] as pictures, uint8 [T, H, W, 3]."""
        return np.round((self.rgb(latents) + 1.0) * 127.5).astype(np.uint8)

    def depth_m(self, latents: Tensor) -> Float32Array:
        """Standardised depth latents [F, C, h, w] as metres, float32 [T, H, W]."""
        video = self.codec.decode(self.standard.raw_depth(latents.float().cpu().numpy()))
        return depth_m_from_latent_video(video, self.depth_range)
