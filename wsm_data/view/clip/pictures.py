"""Pictures of a clip: what its latents decode to at some of its frames."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array, Uint8Array, require_array
from wsm_data.schema.clip import Clip
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_data.view.drawing.depth_colours import depth_picture


@dataclass(frozen=True, kw_only=True)
class DecodedFrames:
    """What the latents of a clip decode to at N of its frames.

    Attributes:
        frames: which raw frames.
        rgb_u8: colour; uint8 [N, H, W, 3].
        depth_m: depth along the optical axis, m; float32 [N, H, W]; 0 where the clip has no depth.
        measured: false in the latent cells of which less than half was measured, whose depth means nothing;
            bool [N, H, W].
    """

    frames: tuple[int, ...]
    rgb_u8: Uint8Array
    depth_m: Float32Array
    measured: BoolArray

    def __post_init__(self) -> None:
        require_array("rgb_u8", self.rgb_u8, np.uint8, (len(self.frames), None, None, 3))
        require_array("depth_m", self.depth_m, np.float32, self.rgb_u8.shape[:3])
        require_array("measured", self.measured, np.bool_, self.rgb_u8.shape[:3])


@dataclass(frozen=True, kw_only=True)
class ClipPictures:
    """N frames of a clip as pictures.

    Attributes:
        frames: which raw frames.
        rgb_u8: decoded colour; uint8 [N, H, W, 3].
        depth_u8: decoded depth in the colours of `depth_picture`, grey in the latent cells of which less than half was
            measured; uint8 [N, H, W, 3].
        depth_valid_share: share of measured depth pixels in the latent frame of each; float64 [N], 0 without depth.
    """

    frames: tuple[int, ...]
    rgb_u8: Uint8Array
    depth_u8: Uint8Array
    depth_valid_share: Float64Array

    def __post_init__(self) -> None:
        count = len(self.frames)
        require_array("rgb_u8", self.rgb_u8, np.uint8, (count, None, None, 3))
        require_array("depth_u8", self.depth_u8, np.uint8, self.rgb_u8.shape)
        require_array("depth_valid_share", self.depth_valid_share, np.float64, (count,))


def spread_frames(frames: int, count: int) -> tuple[int, ...]:
    """At most `count` of `frames` frame numbers, evenly spread, the first and the last among them."""
    return tuple(dict.fromkeys(np.linspace(0, frames - 1, min(count, frames)).round().astype(int).tolist()))


def decode_frames(clip: Clip, codec: VideoCodec, frames: Sequence[int]) -> DecodedFrames:
    """Decode a clip and keep some frames.

    Raises:
        ConfigError: the clip was encoded with another codec, whose latents mean something else.
    """
    _require_same_codec(clip, codec)
    chosen = list(frames)
    rgb = codec.decode(clip.rgb_latent.astype(np.float32))[chosen]
    depth_m = np.zeros(rgb.shape[:3], np.float32)
    if clip.depth_latent is not None:
        depth_video = codec.decode(clip.depth_latent.astype(np.float32))[chosen]
        depth_m = depth_m_from_latent_video(depth_video, clip.meta.depth_range)
    return DecodedFrames(
        frames=tuple(chosen),
        rgb_u8=np.round((np.clip(rgb, -1.0, 1.0) + 1.0) * 127.5).astype(np.uint8),
        depth_m=depth_m,
        measured=_measured(_cells(clip, chosen), depth_m.shape[1:]),
    )


def decode_pictures(clip: Clip, codec: VideoCodec, frames: Sequence[int]) -> ClipPictures:
    """Decode a clip and keep some frames as pictures.

    Raises:
        ConfigError: the clip was encoded with another codec, whose latents mean something else.
    """
    decoded = decode_frames(clip, codec, frames)
    return ClipPictures(
        frames=decoded.frames,
        rgb_u8=decoded.rgb_u8,
        depth_u8=depth_picture(decoded.depth_m, clip.meta.depth_range, decoded.measured),
        depth_valid_share=_cells(clip, decoded.frames).reshape(len(decoded.frames), -1).mean(axis=1) / 255.0,
    )


def _cells(clip: Clip, frames: Sequence[int]) -> Uint8Array:
    """Share of measured pixels, 0..255, in each cell of the latent of each frame; 0 where the clip has no depth."""
    latents = [-(-frame // TEMPORAL_RATIO) for frame in frames]  # latent j >= 1 covers the raw frames 4j - 3 .. 4j
    if clip.depth_valid is None:
        return np.zeros((len(latents), *clip.rgb_latent.shape[2:]), np.uint8)
    return clip.depth_valid[latents]


def _measured(depth_valid: Uint8Array, size: tuple[int, ...]) -> BoolArray:
    height, width = size[0] // depth_valid.shape[1], size[1] // depth_valid.shape[2]
    return np.repeat(np.repeat(depth_valid >= 128, height, axis=1), width, axis=2)


def _require_same_codec(clip: Clip, codec: VideoCodec) -> None:
    info, meta = codec.describe(), clip.meta
    if info.digest != meta.codec_digest:
        raise ConfigError(
            f"clip {meta.key} was encoded with codec {meta.codec} ({meta.codec_digest}) and only that decodes it, "
            f"found {info.name} ({info.digest}); open it with the codec its release names"
        )
