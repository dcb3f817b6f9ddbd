"""The built-in codec: no weights, the geometry of the Wan2.2 VAE (48 channels, 4 x 16 x 16, first frame alone).

A latent cell holds the 48 lowest coefficients of the orthonormal 3-D cosine transform of its block of 4 frames and
16 x 16 pixels, in YCbCr. "Lowest" is the weighted frequency w (1 + 2 t + y + x), where w is 1 for luma and 2 for
chroma: exactly 48 coefficients have at most 6, so no tie is ever broken. They are 34 of Y, 7 of Cb and 7 of Cr.

The two weights were tuned once, for PSNR, on three real and six generated noisy videos at 320 x 192, then frozen. Of
756 rules (other weights; Euclidean and hyperbolic frequency) none had a higher mean. Against the best 48 coefficients
of each video for itself, this one set loses 0.4 to 1.0 dB, and 2.3 dB in one real video.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.codecs.base import EncoderState, require_latents, require_next_frames, require_video
from wsm_data.codecs.dct_kernels import FRAMES, SIDE, cosine_basis, forward, inverse
from wsm_data.files.digest import digest_json
from wsm_data.schema.arrays import Float32Array, Int16Array
from wsm_data.schema.codec import WHITENING, CodecInfo

CHANNELS = 48
_ALGORITHM = 1  # raise when the same settings give other bits
_TEMPORAL_WEIGHT = 2
_PLANE_WEIGHTS = (1, 2, 2)  # Y, Cb, Cr
_HIGHEST_WEIGHTED_FREQUENCY = 6
_SCALE = 0.125
"""Latent per orthonormal coefficient: the constant of a white block is 32, its latent 4. A power of two, so exact."""

_WHITENING = 0.5
"""Channels are frequencies, and the lowest holds most of the energy: evened out wholly, a mean over channels says
no more of it than of the finest texture. One half was measured beside 0 and 1 (docs/learning.md)."""

_RED, _BLUE = np.float32(0.299), np.float32(0.114)  # luma of ITU-R BT.601, full range, as in JPEG
_RED_SPAN, _BLUE_SPAN = np.float32(1.402), np.float32(1.772)  # 2 (1 - luma share), so that Cb and Cr fill [-1, 1]
_GREEN = np.float32(0.587)

_IN_TIME = cosine_basis(FRAMES)
_IN_SPACE = cosine_basis(SIDE)


def coefficient_table() -> Int16Array:
    """What each latent channel holds: int16 [48, 4], rows of (plane, t, y, x), plane 0 = Y, 1 = Cb, 2 = Cr.

    Channels are in the order of weighted frequency, then plane, t, y, x: channel 0 is the mean luma of the block.
    """
    grid = np.argwhere(np.ones((3, FRAMES, SIDE, SIDE), bool))
    cost = np.array(_PLANE_WEIGHTS)[grid[:, 0]] * (1 + grid @ [0, _TEMPORAL_WEIGHT, 1, 1])
    order = np.argsort(cost, kind="stable")
    return grid[order[cost[order] <= _HIGHEST_WEIGHTED_FREQUENCY]].astype(np.int16)


def _channels_of_planes() -> tuple[tuple[np.ndarray, Int16Array], ...]:
    """For each plane the channels it fills and their (t, y, x), in the order in which the kernels share work."""
    table = coefficient_table()
    planes = []
    for plane in range(3):
        channels = np.flatnonzero(table[:, 0] == plane)
        channels = channels[np.lexsort(table[channels, :0:-1].T)]
        planes.append((channels, np.ascontiguousarray(table[channels, 1:])))
    return tuple(planes)


_PLANES = _channels_of_planes()


@dataclass(frozen=True, kw_only=True)
class DctEncoderState:
    """Implements `EncoderState`: a latent depends on its own frames alone, so only their number is kept."""

    latents: int

    def arrays(self) -> dict[str, np.ndarray]:
        """See `EncoderState.arrays`."""
        return {"latents": np.array(self.latents)}


@dataclass(frozen=True)
class DctCodec:
    """Implements `VideoCodec` on the CPU, in float32.

    A channel means the same in every latent: the first frame counts as held for four frames, so its temporal
    coefficients are zero and its constant is scaled like any other. Each latent is computed from its own frames alone,
    with arithmetic that does not depend on threads: a prefix of a video has a prefix of its latents, bit for bit.
    """

    def encode(self, video: Float32Array) -> Float32Array:
        """See `VideoCodec.encode`. A grey video given as a broadcast view of one channel takes a third of the time."""
        require_video(video)
        frames, height, width, _ = video.shape
        latents = np.zeros((1 + (frames - 1) // FRAMES, CHANNELS, height // SIDE, width // SIDE), np.float32)
        planes = _planes_for(video)
        for j, latent in enumerate(latents):
            _fill_latent(video[:1] if j == 0 else video[FRAMES * j - 3 : FRAMES * j + 1], planes, latent)
        return latents

    def encode_many(self, videos: Sequence[Float32Array]) -> list[Float32Array]:
        """See `VideoCodec.encode_many`."""
        return [self.encode(video) for video in videos]

    def encode_next(self, frames: Float32Array, state: EncoderState | None = None) -> tuple[Float32Array, EncoderState]:
        """See `VideoCodec.encode_next`; the same bits as in `encode`."""
        done = state.latents if state else 0
        require_next_frames(frames, done)
        height, width = frames.shape[1:3]
        latent = np.zeros((CHANNELS, height // SIDE, width // SIDE), np.float32)
        _fill_latent(frames, _planes_for(frames), latent)
        return latent, DctEncoderState(latents=done + 1)

    def restored(self, arrays: Mapping[str, np.ndarray]) -> EncoderState:
        """See `VideoCodec.restored`."""
        return DctEncoderState(latents=int(arrays["latents"]))

    def decode(self, latents: Float32Array) -> Float32Array:
        """See `VideoCodec.decode`. Of latent 0 only what a held frame can have is used: its temporal means."""
        require_latents(latents, CHANNELS)
        count, _, rows, columns = latents.shape
        video = np.empty((1 + FRAMES * (count - 1), SIDE * rows, SIDE * columns, 3), np.float32)
        planes = np.empty((3, FRAMES, SIDE * rows, SIDE * columns), np.float32)
        scaled = latents / np.float32(_SCALE)
        scaled[0, coefficient_table()[:, 1] > 0] = 0
        for j, latent in enumerate(scaled):
            for plane, (channels, frequencies) in zip(planes, _PLANES, strict=True):
                inverse(latent[channels], frequencies, _IN_TIME, _IN_SPACE, plane)
            if j == 0:
                _fill_colours(planes[:, :1], video[:1])
            else:
                _fill_colours(planes, video[FRAMES * j - 3 : FRAMES * j + 1])
        return video

    def describe(self) -> CodecInfo:
        """See `VideoCodec.describe`."""
        settings: dict[str, object] = {
            "algorithm": _ALGORITHM,
            "coefficients": coefficient_table().tolist(),
            "scale": _SCALE,
            "colours": "YCbCr, ITU-R BT.601, full range",
        }
        return CodecInfo(
            name="dct",
            digest=digest_json({"name": "dct", "dtype": "float32", **settings}),
            channels=CHANNELS,
            temporal_ratio=FRAMES,
            spatial_ratio=SIDE,
            settings={**settings, WHITENING: _WHITENING},
        )


def _planes_for(video: Float32Array) -> Float32Array:
    """Memory for the planes of a latent; equal channels have no chroma: those latents are zero either way."""
    used = 1 if video.strides[-1] == 0 else 3
    return np.empty((used, FRAMES, *video.shape[1:3]), np.float32)


def _fill_latent(frames: Float32Array, planes: Float32Array, latent: Float32Array) -> None:
    """Encode the one or four frames of a latent into its zeros."""
    _fill_planes(frames, planes)
    for plane, (channels, frequencies) in zip(planes, _PLANES, strict=False):
        coefficients = np.empty((len(channels), *latent.shape[1:]), np.float32)
        forward(plane, frequencies, _IN_TIME, _IN_SPACE, coefficients)
        latent[channels] = coefficients
    if len(frames) == 1:
        latent[coefficient_table()[:, 1] > 0] = 0  # the rounding of a sum that is zero in exact arithmetic
    latent *= np.float32(_SCALE)


def _fill_planes(video: Float32Array, planes: Float32Array) -> None:
    """Convert one or four frames to luma, and chroma where `planes` has it; a single frame is held.

    Luma is written as green plus differences, so that a grey pixel's luma is its value and its chroma zero, exactly.
    """
    red, green, blue = (video[..., channel] for channel in range(3))
    if len(planes) == 1:
        planes[0] = green
        return
    luma = green + _RED * (red - green) + _BLUE * (blue - green)
    planes[0] = luma
    planes[1] = (blue - luma) / _BLUE_SPAN
    planes[2] = (red - luma) / _RED_SPAN


def _fill_colours(planes: Float32Array, video: Float32Array) -> None:
    """Inverse of `_fill_planes`, clamped to [-1, 1]."""
    luma, blue_difference, red_difference = planes
    video[..., 0] = luma + _RED_SPAN * red_difference
    video[..., 2] = luma + _BLUE_SPAN * blue_difference
    green_shift = (_RED * _RED_SPAN / _GREEN) * red_difference + (_BLUE * _BLUE_SPAN / _GREEN) * blue_difference
    video[..., 1] = luma - green_shift
    np.clip(video, -1, 1, out=video)
