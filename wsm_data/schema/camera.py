"""Pinhole intrinsics of one image size."""

from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Float64Array


@dataclass(frozen=True, kw_only=True)
class Intrinsics:
    """A pinhole camera in pixels, where the centre of the first pixel is at (0, 0).

    Attributes:
        fx: focal length along the image's x axis, px.
        fy: focal length along the image's y axis, px.
        cx: principal point along x, px; the image spans -1/2 to width - 1/2.
        cy: principal point along y, px.
        width: image width the numbers belong to, px.
        height: image height the numbers belong to, px.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            if not np.isfinite(getattr(self, name)):
                raise ValueError(f"{name} must be finite, found {getattr(self, name)}")
        for name in ("fx", "fy", "width", "height"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} must be positive, found {getattr(self, name)}")
        if not (-0.5 <= self.cx < self.width - 0.5 and -0.5 <= self.cy < self.height - 0.5):
            raise ValueError(
                f"the principal point (cx, cy) must lie in the {self.width}x{self.height} image, found "
                f"({self.cx}, {self.cy}); do the intrinsics belong to another image size?"
            )

    @property
    def matrix(self) -> Float64Array:
        """Camera matrix K, float64 [3, 3]."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def resized(self, width: int, height: int) -> "Intrinsics":
        """Return the intrinsics after the whole image is resized per axis, without crop.

        Pixel areas scale, so a centre c goes to (c + 1/2) s - 1/2.
        """
        sx, sy = width / self.width, height / self.height
        return Intrinsics(
            fx=self.fx * sx,
            fy=self.fy * sy,
            cx=(self.cx + 0.5) * sx - 0.5,
            cy=(self.cy + 0.5) * sy - 0.5,
            width=width,
            height=height,
        )
