"""The images of an episode, as its source has them: files that are still encoded, or pixels."""

from collections.abc import Sequence
from dataclasses import dataclass

from wsm_data.schema.arrays import Uint8Array, Uint16Array

RgbFrame = bytes | Uint8Array
"""A JPEG file or one of a PNG of 8-bit colours, or its pixels, rgb_u8 [H, W, 3]."""

DepthFrame = bytes | Uint16Array
"""A 16-bit grey PNG file, or its raw codes, uint16 [H, W]; how codes become metres is the manifest's `depth`."""


@dataclass(frozen=True, kw_only=True)
class EpisodeFrames:
    """The images of an episode of T frames in time order.

    Attributes:
        rgb: T colour images.
        depth: T depth images, None where a frame has none.
    """

    rgb: Sequence[RgbFrame]
    depth: Sequence[DepthFrame | None]

    def __post_init__(self) -> None:
        if len(self.rgb) != len(self.depth):
            raise ValueError(f"a frame has one place for depth, found {len(self.rgb)} and {len(self.depth)}")
