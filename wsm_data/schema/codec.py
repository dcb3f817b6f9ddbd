"""What a codec says of itself: stored in every clip and release, compared before anything is mixed."""

from collections.abc import Mapping
from dataclasses import dataclass, field

WHITENING = "whitening"
"""The setting by which a codec says how its latents are to be standardised."""


@dataclass(frozen=True, kw_only=True)
class CodecInfo:
    """Geometry and identity of a video codec.

    Attributes:
        name: `dct` or `wan`.
        digest: digest of everything that decides its output: settings, weights, dtype.
        channels: C, channels of a latent.
        temporal_ratio: raw frames in a latent frame after the first.
        spatial_ratio: pixels of a latent cell's side.
        dtype: arithmetic in which latents are computed.
        latent_mean: the codec's own mean per channel for standardising RGB latents; empty where it has none.
        latent_std: the codec's own standard deviation per channel; empty where it has none.
        settings: everything else that is worth reading, and `whitening` where it is not 1.
    """

    name: str
    digest: str
    channels: int = 48
    temporal_ratio: int = 4
    spatial_ratio: int = 16
    dtype: str = "float32"
    latent_mean: tuple[float, ...] = ()
    latent_std: tuple[float, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 <= self.whitening <= 1:
            raise ValueError(f"whitening must lie in [0, 1], found {self.whitening}")

    @property
    def whitening(self) -> float:
        """How far standardising evens out the channels: see `wsm_data.shards.latent_standard.channel_scales`.

        From 0 (one scale for all) to 1 (all have deviation 1, the paper's), which is what a codec wants that says
        nothing. Latents do not depend on it.
        """
        stated = self.settings.get(WHITENING, 1.0)
        if not isinstance(stated, float):
            raise ValueError(f"{WHITENING} must be a number with a point, found {stated!r}")
        return stated
