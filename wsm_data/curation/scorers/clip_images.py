"""What the scores of images look at: latents, the validity of depth, and a few decoded depth frames."""

from dataclasses import dataclass

import numpy as np

from wsm_data.codecs.base import VideoCodec
from wsm_data.schema.arrays import Float16Array, Float32Array, Float64Array, Uint8Array, require_array
from wsm_data.schema.clip import Clip
from wsm_data.shards.statistics import real_latents


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipImages:
    """The images of a clip, without the latents of nothing but repeated frames.

    Attributes:
        rgb_latent: codec latents of the colour video; float16 [F, C, h, w].
        rgb_std: standard deviation of each channel over the release; float64 [C].
        depth_valid: share of valid depth pixels per latent cell, 0..255; uint8 [F, h, w]. None where the clip has no
            depth.
        sampled: numbers of the latents of which depth was decoded; int64 [n].
        sampled_depth: one decoded frame of log-depth 2u - 1 in [-1, 1] for each of them; float32 [n, H, W].
    """

    rgb_latent: Float16Array
    rgb_std: Float64Array
    depth_valid: Uint8Array | None
    sampled: np.ndarray
    sampled_depth: Float32Array

    def __post_init__(self) -> None:
        count, channels, *cells = self.rgb_latent.shape
        require_array("rgb_std", self.rgb_std, np.float64, (channels,))
        if self.depth_valid is not None:
            require_array("depth_valid", self.depth_valid, np.uint8, (count, *cells))
        require_array("sampled_depth", self.sampled_depth, np.float32, (len(self.sampled), None, None))


def images_of(clip: Clip, rgb_std: Float64Array, codec: VideoCodec | None, depth_samples: int) -> ClipImages:
    """The images of a stored clip.

    Args:
        clip: the clip.
        rgb_std: standard deviation of each channel of the colour latents over the release; float64 [C].
        codec: decodes single latents of depth on their own; None where the release's codec cannot, or not cheaply.
        depth_samples: how many latents are decoded, spread evenly over the clip.
    """
    count = real_latents(clip.meta.frames, clip.meta.padded_frames)
    depth, valid = clip.depth_latent, clip.depth_valid
    wanted = min(depth_samples, count) if codec is not None and depth is not None else 0
    sampled = np.rint((np.arange(wanted) + 0.5) * count / max(wanted, 1) - 0.5).astype(np.int64)
    frames = [_decoded(depth[number], codec) for number in sampled] if codec is not None and depth is not None else []
    height, width = clip.intrinsics.height, clip.intrinsics.width
    return ClipImages(
        rgb_latent=clip.rgb_latent[:count],
        rgb_std=rgb_std,
        depth_valid=None if valid is None else valid[:count],
        sampled=sampled,
        sampled_depth=np.stack(frames) if frames else np.empty((0, height, width), np.float32),
    )


def _decoded(latent: Float16Array, codec: VideoCodec) -> Float32Array:
    """One frame for a latent on its own, the mean of the frames it covers; float32 [H, W]."""
    return np.asarray(codec.decode(latent[None].astype(np.float32))[0].mean(axis=-1, dtype=np.float32))
