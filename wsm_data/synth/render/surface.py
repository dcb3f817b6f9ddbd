"""Surfaces as patches: parallelograms for what is flat, smooth triangles for what is round."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum, auto

import numpy as np

from wsm_data.schema.arrays import BoolArray, Float64Array, Int16Array

Point = tuple[float, float, float]
Colour = tuple[float, float, float]


class Texture(IntEnum):
    """The texture layers every home has; what they show differs from home to home."""

    PLAIN = 0
    PLASTER = auto()
    PLANKS = auto()
    PARQUET = auto()
    TILES = auto()
    WALL_TILES = auto()
    CARPET = auto()
    STRIPES = auto()
    ORNAMENT = auto()
    DOTS = auto()
    WOOD = auto()
    FABRIC = auto()
    LEATHER = auto()
    STONE = auto()
    METAL = auto()
    WICKER = auto()
    LEAF = auto()
    BARK = auto()
    BOOK = auto()
    SCREEN = auto()
    MIRROR = auto()
    VIEW_GARDEN = auto()
    VIEW_TOWN = auto()
    RUG_BORDER = auto()
    RUG_GEOMETRIC = auto()
    RUG_STRIPED = auto()
    PICTURE_HILLS = auto()
    PICTURE_SEA = auto()
    PICTURE_CIRCLES = auto()
    PICTURE_BLOCKS = auto()
    PICTURE_STROKES = auto()
    PICTURE_FLOWER = auto()
    DUVET = auto()
    BRICK = auto()


@dataclass(frozen=True, kw_only=True)
class Material:
    """How a surface looks.

    Attributes:
        texture: layer it is covered with.
        tint: factors of red, green and blue on the texture.
        repeat_m: side of one repeat of the texture on the surface, m.
        emission: light it gives off itself; 1 shows the texture as it is without any lamp.
        two_sided: whether its back can be seen (leaves, curtains), else it belongs to a closed solid.
    """

    texture: Texture = Texture.PLAIN
    tint: Colour = (1.0, 1.0, 1.0)
    repeat_m: float = 1.0
    emission: float = 0.0
    two_sided: bool = False


@dataclass(frozen=True, kw_only=True)
class Surface:
    """P patches; a patch has corners a, b, d, and is a parallelogram a b c d with c = b + d - a, or a triangle a b d.

    Attributes:
        points_m: a, b, d; float64 [P, 3, 3]. The front shows (b - a) x (d - a).
        normals: unit normals at a, b, d for the light; float64 [P, 3, 3].
        uv: texture coordinates at a, b, d in repeats of the texture, v down; float64 [P, 3, 2].
        quad: parallelogram or triangle; bool [P].
        texture: layer; int16 [P].
        tint: factors of red, green and blue; float64 [P, 3].
        emission: own light; float64 [P].
        two_sided: whether the back can be seen; bool [P].
    """

    points_m: Float64Array
    normals: Float64Array
    uv: Float64Array
    quad: BoolArray
    texture: Int16Array
    tint: Float64Array
    emission: Float64Array
    two_sided: BoolArray

    def __len__(self) -> int:
        return len(self.points_m)


def make_surface(
    points_m: Float64Array, normals: Float64Array, uv: Float64Array, quad: bool, material: Material
) -> Surface:
    """Patches of one material; arrays as in `Surface`."""
    count = len(points_m)
    return Surface(
        points_m=points_m,
        normals=normals,
        uv=uv,
        quad=np.full(count, quad),
        texture=np.full(count, int(material.texture), np.int16),
        tint=np.tile(np.array(material.tint, np.float64), (count, 1)),
        emission=np.full(count, material.emission),
        two_sided=np.full(count, material.two_sided),
    )


def join(surfaces: Sequence[Surface]) -> Surface:
    """All patches of several surfaces, in order."""
    names = [field.name for field in fields(Surface)]
    return Surface(**{name: np.concatenate([getattr(surface, name) for surface in surfaces]) for name in names})


def placed(surface: Surface, xyz_m: Point, yaw_rad: float = 0.0) -> Surface:
    """The surface turned about z by `yaw_rad`, then moved by `xyz_m`."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    if yaw_rad % (np.pi / 2) == 0:  # quarter turns keep boxes on the axes to the bit
        c, s = np.round(c), np.round(s)
    R_T = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    changed = {
        "points_m": surface.points_m @ R_T + np.array(xyz_m),
        "normals": surface.normals @ R_T,
    }
    rest = {field.name: getattr(surface, field.name) for field in fields(Surface) if field.name not in changed}
    return Surface(**changed, **rest)


def parallelograms(
    corners_m: Float64Array,
    edges_u_m: Float64Array,
    edges_v_m: Float64Array,
    material: Material,
    fit: BoolArray | None = None,
    turn: bool = True,
) -> Surface:
    """Flat patches of one material.

    Args:
        corners_m: a; [N, 3].
        edges_u_m: b - a; [N, 3].
        edges_v_m: d - a; [N, 3].
        material: of all of them.
        fit: which patches the texture covers exactly once, upright when edge v points up; the others it repeats over,
            measured from the frame's origin, so that neighbours in one plane continue one another.
        turn: let the texture's u axis, along which wood grain runs, follow the longer edge; else always edge u.
    """
    a, u, v = (np.asarray(array, np.float64) for array in (corners_m, edges_u_m, edges_v_m))
    length_u, length_v = (np.sqrt((edge * edge).sum(axis=1)) for edge in (u, v))
    normal = np.stack([u[:, i] * v[:, j] - u[:, j] * v[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    normal /= np.sqrt((normal * normal).sum(axis=1))[:, None]
    s, t = (a * u).sum(axis=1) / length_u, -(a * v).sum(axis=1) / length_v
    uv = np.stack([s, t, s + length_u, t, s, t - length_v], axis=1).reshape(-1, 3, 2) / material.repeat_m
    if turn:
        upright = (length_v > length_u)[:, None, None]
        uv = np.where(upright, uv[..., ::-1], uv)
    if fit is not None:
        uv[fit] = ((0.0, 1.0), (1.0, 1.0), (0.0, 0.0))
    points = np.stack([a, a + u, a + v], axis=1)
    return make_surface(points, np.repeat(normal[:, None], 3, axis=1), uv, True, material)


def parallelogram(corner_m: Point, edge_u_m: Point, edge_v_m: Point, material: Material, fit: bool = False) -> Surface:
    """One flat patch; with `fit` the texture covers it once, upright when edge v points up."""
    a, u, v = (np.array([value]) for value in (corner_m, edge_u_m, edge_v_m))
    return parallelograms(a, u, v, material, fit=np.array([fit]))


def panel(corner_m: Point, edge_u_m: Point, edge_v_m: Point, material: Material) -> Surface:
    """One flat patch whose texture is upright and never turned: u along edge u, v down against edge v (walls)."""
    a, u, v = (np.array([value]) for value in (corner_m, edge_u_m, edge_v_m))
    return parallelograms(a, u, v, material, turn=False)
