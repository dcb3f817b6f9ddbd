"""What becomes of the frames of one environment: every fourth completes a latent of the video since its start."""

from dataclasses import dataclass, field

import numpy as np
import torch

from wsm_data.codecs.base import EncoderState, VideoCodec
from wsm_data.codecs.resize import resize_colour
from wsm_data.errors import DataError, Reason
from wsm_data.schema.arrays import Float32Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_model.config import ModelConfig


@dataclass(kw_only=True)
class Video:
    """The video of one environment while it goes on.

    Attributes:
        state: of its encoding; None before the first latent.
        frames: those that wait for the rest of their latent, float32 [H, W, 3].
    """

    state: EncoderState | None = None
    frames: list[Float32Array] = field(default_factory=list)


class Eye:
    """Turns pictures into standardised latents as clips are made: resized per axis, without crop, then encoded.

    Args:
        codec: that of the model's latents.
        standard: of the model's latents.
        model: shape of the model.
    """

    def __init__(self, codec: VideoCodec, standard: LatentStandard, model: ModelConfig):
        side_px = codec.describe().spatial_ratio
        self._codec, self._standard = codec, standard
        self._size = (model.latent_height * side_px, model.latent_width * side_px)

    def see(self, video: Video, rgb_u8: Uint8Array, camera: Intrinsics) -> torch.Tensor | None:
        """Take one more frame; the latent that it completes, float32 [C, h, w], or None.

        Raises:
            DataError: `frame.size_mismatch`: it is not of the camera that was announced.
        """
        if rgb_u8.shape != (camera.height, camera.width, 3) or rgb_u8.dtype != np.uint8:
            raise DataError(
                Reason.FRAME_SIZE_MISMATCH,
                f"frames must be uint8 of the camera that reset was called with, {camera.width}x{camera.height} px and "
                f"3 channels, found {rgb_u8.dtype} {list(rgb_u8.shape)}; reset with the camera that is used",
            )
        frame = np.empty((*self._size, 3), np.float32)
        resize_colour(rgb_u8, frame)
        video.frames.append(frame)
        if len(video.frames) < (1 if video.state is None else TEMPORAL_RATIO):
            return None
        latent, video.state = self._codec.encode_next(np.stack(video.frames), video.state)
        video.frames = []
        return torch.from_numpy(self._standard.standard_rgb(latent))

    def pictures(self, seen: torch.Tensor, dreamed: torch.Tensor) -> Uint8Array:
        """A dream for people to look at, uint8 [4 F, H, W, 3].

        Args:
            seen: the standardised latent before it, [C, h, w]: a decoder begins with one frame.
            dreamed: its standardised latents [F, C, h, w].
        """
        latents = torch.cat([seen[None], dreamed]).float().cpu().numpy()
        decoded = self._codec.decode(self._standard.raw_rgb(latents))[1:]
        return np.round((decoded + 1.0) * 127.5).astype(np.uint8)
