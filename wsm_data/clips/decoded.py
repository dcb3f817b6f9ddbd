"""Back from latents to frames: what a clip decodes to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import BoolArray, Float32Array, Uint8Array, require_array
from wsm_data.schema.clip import Clip
from wsm_data.schema.sequence import latent_of

_HALF_MEASURED = 128  # of 255


@dataclass(frozen=True, kw_only=True, repr=False)
class DecodedVideo:
    """What the latents of a clip decode to at N of its frames.

    Attributes:
        frames: which raw frames.
        rgb: colour; uint8 [N, H, W, 3].
        depth_m: depth along the optical axis, m; float32 [N, H, W]; 0 where the clip has no depth.
        measured: false in the latent cells of which less than half was measured, whose depth means nothing;
            bool [N, H, W].
    """

    frames: tuple[int, ...]
    rgb: Uint8Array
    depth_m: Float32Array
    measured: BoolArray

    def __post_init__(self) -> None:
        require_array("rgb", self.rgb, np.uint8, (len(self.frames), None, None, 3))
        require_array("depth_m", self.depth_m, np.float32, self.rgb.shape[:3])
        require_array("measured", self.measured, np.bool_, self.rgb.shape[:3])

    def __repr__(self) -> str:
        count, height, width = self.depth_m.shape
        return f"<DecodedVideo: {count} frames of {width} x {height} px, depth measured in {self.measured.mean():.0%}>"


def decode_video(clip: Clip, codec: VideoCodec, frames: Sequence[int] | None = None) -> DecodedVideo:
    """Decode a clip.

    Args:
        clip: the clip.
        codec: the codec it was encoded with.
        frames: raw frames to keep; None: all T, padding included.

    Raises:
        ConfigError: the clip was encoded with another codec, whose latents mean something else.
        IndexError: the clip has no such frame.
    """
    _require_same_codec(clip, codec)
    chosen = list(range(clip.frame_count)) if frames is None else list(frames)
    if any(not 0 <= frame < clip.frame_count for frame in chosen):
        raise IndexError(f"clip {clip.meta.key} has the frames 0 to {clip.frame_count - 1}, found {chosen}")
    needed = slice(1 + latent_of(max(chosen, default=0)))  # codecs are causal: later latents change no earlier frame
    rgb = codec.decode(clip.rgb_latent[needed].astype(np.float32))[chosen]
    depth_m = np.zeros(rgb.shape[:3], np.float32)
    if clip.depth_latent is not None:
        depth_video = codec.decode(clip.depth_latent[needed].astype(np.float32))[chosen]
        depth_m = depth_m_from_latent_video(depth_video, clip.meta.depth_range)
    return DecodedVideo(
        frames=tuple(chosen),
        rgb=np.round((np.clip(rgb, -1.0, 1.0) + 1.0) * 127.5).astype(np.uint8),
        depth_m=depth_m,
        measured=_measured(valid_cells(clip, chosen), depth_m.shape[1:]),
    )


def valid_cells(clip: Clip, frames: Sequence[int]) -> Uint8Array:
    """`depth_valid` of the latent that each raw frame lies in; uint8 [N, h, w], 0 where the clip has no depth."""
    latents = [latent_of(frame) for frame in frames]
    if clip.depth_valid is None:
        return np.zeros((len(latents), *clip.rgb_latent.shape[2:]), np.uint8)
    return clip.depth_valid[latents]


def _measured(depth_valid: Uint8Array, size: tuple[int, ...]) -> BoolArray:
    height, width = size[0] // depth_valid.shape[1], size[1] // depth_valid.shape[2]
    return np.repeat(np.repeat(depth_valid >= _HALF_MEASURED, height, axis=1), width, axis=2)


def _require_same_codec(clip: Clip, codec: VideoCodec) -> None:
    info, meta = codec.describe(), clip.meta
    if info.digest != meta.codec_digest:
        raise ConfigError(
            f"clip {meta.key} was encoded with codec {meta.codec} ({meta.codec_digest}) and only that decodes it, "
            f"found {info.name} ({info.digest}); open it with the codec its release names"
        )
