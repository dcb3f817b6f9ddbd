"""What a video codec is to the rest of the project."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from wsm_data.schema.arrays import Float32Array, require_array
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.sequence import TEMPORAL_RATIO

SIDE_MULTIPLE_PX = 32
"""Sides of a video are multiples of this: 16 pixels a latent cell, and 2 x 2 cells a patch of the transformer."""


class EncoderState(Protocol):
    """Where the encoding of one video stands that comes latent by latent. To encode on from it leaves it as it was."""

    @property
    def latents(self) -> int:
        """Latents encoded so far."""

    def arrays(self) -> dict[str, np.ndarray]:
        """All of it as arrays, to be stored; `VideoCodec.restored` is the way back."""


class ClipCodec(Protocol):
    """What a clip is made with: the part of a `VideoCodec` that encodes and decodes whole videos."""

    def encode_many(self, videos: Sequence[Float32Array]) -> list[Float32Array]:
        """See `VideoCodec.encode_many`."""

    def decode(self, latents: Float32Array) -> Float32Array:
        """See `VideoCodec.decode`."""

    def describe(self) -> CodecInfo:
        """See `VideoCodec.describe`."""


class VideoCodec(ClipCodec, Protocol):
    """A causal codec: T = 1 + 4k frames to F = 1 + k latents; latent j sees no frame after 4j, no frame a later latent.

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

    def encode_next(self, frames: Float32Array, state: EncoderState | None = None) -> tuple[Float32Array, EncoderState]:
        """The next latent of a video that is still going on, as it stands in `encode` of the whole.

        Args:
            frames: the first frame alone, float32 [1, H, W, 3]; after it the next four.
            state: what the call before gave for this video; None for the first frame.

        Returns:
            The latent, float32 [C, h, w], and the state behind it.

        Raises:
            ValueError: another number of frames, a side that is not a multiple of 32, a state that does not fit.
        """

    def restored(self, arrays: Mapping[str, np.ndarray]) -> EncoderState:
        """The state that gave these arrays."""

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
    if len(video) % TEMPORAL_RATIO != 1:
        raise ValueError(f"a video must have 1 + 4k frames, found {len(video)}; pad it with repeats of its last frame")
    _require_sides(video)


def require_next_frames(frames: Float32Array, latents: int) -> None:
    """Check that `frames` are those of the next latent after `latents` others: one for the first, four for each later.

    Raises:
        ValueError: names what must hold and what was found.
    """
    require_array("frames", frames, np.float32, (None, None, None, 3))
    wanted = TEMPORAL_RATIO if latents else 1
    if len(frames) != wanted:
        raise ValueError(f"latent {latents} of a video is made of {wanted} frames, found {len(frames)}")
    _require_sides(frames)


def _require_sides(video: Float32Array) -> None:
    height, width = video.shape[1:3]
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
