"""Pictures of a clip: what its latents decode to at some of its frames."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.clips.decoded import decode_video, valid_cells
from wsm_data.codecs.base import VideoCodec
from wsm_data.schema.arrays import Float64Array, Uint8Array, require_array
from wsm_data.schema.clip import Clip
from wsm_data.view.drawing.depth_colours import depth_picture


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


def decode_pictures(clip: Clip, codec: VideoCodec, frames: Sequence[int]) -> ClipPictures:
    """Decode a clip and keep some frames as pictures.

    Raises:
        ConfigError: the clip was encoded with another codec, whose latents mean something else.
    """
    decoded = decode_video(clip, codec, frames)
    return ClipPictures(
        frames=decoded.frames,
        rgb_u8=decoded.rgb,
        depth_u8=depth_picture(decoded.depth_m, clip.meta.depth_range, decoded.measured),
        depth_valid_share=valid_cells(clip, decoded.frames).reshape(len(decoded.frames), -1).mean(axis=1) / 255.0,
    )
