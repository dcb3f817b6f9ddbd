"""What a video codec is to the rest of the project."""

from collections.abc import Sequence
from typing import Protocol

from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.codec import CodecInfo


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
        """Latents of several videos, equal to encoding each alone; a codec on a GPU batches them."""

    def decode(self, latents: Float32Array) -> Float32Array:
        """Video of latents [F, C, h, w], float32 [1 + 4 (F - 1), H, W, 3], clamped to [-1, 1]."""

    def describe(self) -> CodecInfo:
        """Geometry and identity; the digest covers everything that decides the output."""
