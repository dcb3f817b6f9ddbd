"""What a video codec is to the rest of the project."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from wsm_data.schema.arrays import Float32Array, require_array
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.sequence import TEMPORAL_RATIO

SIDE_MULTIPLE_PX = 32
"""Sides of a video are multiples of this: 16 pixels a latent cell, and 2 x 2 cells a patch of the transformer."""


class VideoCodec(Protocol):
    """A causal codec: T = 1 + 4k frames to F = 1 + k latents; latent j sees no frame after 4j.

    Videos are float32 [T, H, W, 3] in [-1, 1], H and W multiples of 32; latents are float32 [F, C, h, w] with
    h = H / 16 and w = W / 16, not standardised.
    """

    def encode(self, video: Float32Array) -> Float32Array:
        """Latents of one video.

        Raises:
            ValueError: the length is not 1 + 4k, or a side is not a multiple of 32.
        """

    def encode_many(self, videos: Sequence[Float32Array]) -> list[Float32Array]:
        """Latents of several videos; a codec that batches them agrees with `encode` to the rounding of its dtype."""

    def decode(self, latents: Float32Array) -> Float32Array:
        """Video of latents [F, C, h, w], float32 [1 + 4 (F - 1), H, W, 3], clamped to [-1, 1]."""

    def describe(self) -> CodecInfo:
        """Geometry and identity; the digest covers everything that decides the output."""


def require_video(video: Float32Array) -> None:
    """Check that `video` is what every codec encodes: float32 [1 + 4k, 32 m, 32 n, 3].

    Frames beyond 1 + 4k would be dropped in silence, so another length is refused.

    Raises:
        ValueError: names what must hold and what was found.
    """
    require_array("video", video, np.float32, (None, None, None, 3))
    frames, height, width, _ = video.shape
    if frames % TEMPORAL_RATIO != 1:
        raise ValueError(f"a video must have 1 + 4k frames, found {frames}; pad it with repeats of its last frame")
    if not height or not width or height % SIDE_MULTIPLE_PX or width % SIDE_MULTIPLE_PX:
        raise ValueError(f"sides of a video must be multiples of {SIDE_MULTIPLE_PX} px, found {width}x{height}")


def require_latents(latents: Float32Array, channels: int) -> None:
    """Check that `latents` can be decoded: float32 [F, channels, h, w] with F >= 1.

    Raises:
        ValueError: names what must hold and what was found.
    """
    require_array("latents", latents, np.float32, (None, channels, None, None))
    if not len(latents):
        raise ValueError("latents must hold at least one frame, found none")
