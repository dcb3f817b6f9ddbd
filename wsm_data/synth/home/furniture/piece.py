"""What a piece of furniture is to the room it stands in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.synth.render.surface import Colour, Point, Surface, join, placed

Rectangle = tuple[float, float, float, float]
"""x0, y0, x1, y1, m."""


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A source of light.

    Attributes:
        xyz_m: its centre, m.
        power: red, green and blue of the light on a wall that faces it at 1 m.
        radius_m: size, which softens shadows, m.
    """

    xyz_m: Point
    power: Colour
    radius_m: float = 0.08


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Furniture in a frame of its own: the middle of its back at the origin, its front towards +y, the floor at 0.

    Attributes:
        surface: what is seen.
        footprints: the floor it takes, m; empty for what hangs or lies flat.
        height_m: height, m; high pieces do not go before windows.
        lamps: lights it carries.
    """

    surface: Surface
    footprints: tuple[Rectangle, ...]
    height_m: float
    lamps: tuple[Lamp, ...] = ()


def piece(parts: Sequence[Surface], width_m: float, depth_m: float, height_m: float, *lamps: Lamp) -> Piece:
    """A piece that takes a rectangle of `width_m` by `depth_m` before its back."""
    footprint = (-width_m / 2, 0.0, width_m / 2, depth_m)
    return Piece(surface=join(parts), footprints=(footprint,), height_m=height_m, lamps=lamps)


def move(item: Piece, xy_m: tuple[float, float], yaw_rad: float, z_m: float = 0.0) -> Piece:
    """The piece turned about the origin, then moved; its footprints become the bounds of the turned ones."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    (x, y) = xy_m

    def point(p: Point) -> Point:
        return (float(c * p[0] - s * p[1] + x), float(s * p[0] + c * p[1] + y), p[2] + z_m)

    def rectangle(r: Rectangle) -> Rectangle:
        corners = np.array([point((px, py, 0.0))[:2] for px in (r[0], r[2]) for py in (r[1], r[3])])
        (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    lamps = tuple(Lamp(xyz_m=point(lamp.xyz_m), power=lamp.power, radius_m=lamp.radius_m) for lamp in item.lamps)
    return Piece(
        surface=placed(item.surface, (x, y, z_m), yaw_rad),
        footprints=tuple(map(rectangle, item.footprints)),
        height_m=item.height_m,
        lamps=lamps,
    )


def group(items: Sequence[Piece]) -> Piece:
    """Several pieces that stand together."""
    return Piece(
        surface=join([item.surface for item in items]),
        footprints=tuple(rectangle for item in items for rectangle in item.footprints),
        height_m=max(item.height_m for item in items),
        lamps=tuple(lamp for item in items for lamp in item.lamps),
    )
