"""Colours and materials of a home, chosen to go together."""

from dataclasses import dataclass

import numpy as np

from wsm_data.synth.home.floor_plan import Room
from wsm_data.synth.render.surface import Colour, Material, Texture

_WALLPAPERS = (Texture.STRIPES, Texture.ORNAMENT, Texture.DOTS)


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """A curated set of colours.

    Attributes:
        wood: tint of most furniture.
        dark: tint of the darker wood and of frames.
        walls: tints of walls, pale.
        strong: tints of accent walls and large cloth.
        accents: tints of cushions, books, vases.
        floor: tint of wooden floors.
    """

    wood: Colour
    dark: Colour
    walls: tuple[Colour, ...]
    strong: tuple[Colour, ...]
    accents: tuple[Colour, ...]
    floor: Colour


_SCHEMES = (
    Scheme(  # birch and soft blue
        wood=(0.86, 0.7, 0.5),
        dark=(0.45, 0.33, 0.24),
        walls=((0.95, 0.93, 0.88), (0.84, 0.89, 0.91), (0.94, 0.9, 0.82), (0.86, 0.9, 0.84), (0.93, 0.87, 0.84)),
        strong=((0.36, 0.5, 0.6), (0.46, 0.56, 0.46), (0.72, 0.5, 0.42), (0.5, 0.46, 0.58)),
        accents=((0.9, 0.66, 0.25), (0.25, 0.42, 0.56), (0.82, 0.42, 0.34), (0.93, 0.9, 0.82), (0.42, 0.56, 0.42)),
        floor=(0.84, 0.66, 0.46),
    ),
    Scheme(  # walnut and terracotta
        wood=(0.6, 0.4, 0.26),
        dark=(0.33, 0.22, 0.16),
        walls=((0.96, 0.91, 0.8), (0.93, 0.83, 0.72), (0.9, 0.9, 0.84), (0.88, 0.84, 0.74), (0.94, 0.87, 0.78)),
        strong=((0.72, 0.38, 0.26), (0.35, 0.42, 0.36), (0.76, 0.58, 0.3), (0.42, 0.28, 0.28)),
        accents=((0.2, 0.42, 0.42), (0.86, 0.6, 0.22), (0.72, 0.26, 0.2), (0.94, 0.88, 0.76), (0.46, 0.5, 0.28)),
        floor=(0.64, 0.44, 0.29),
    ),
    Scheme(  # grey oak and emerald
        wood=(0.7, 0.6, 0.5),
        dark=(0.24, 0.22, 0.22),
        walls=((0.9, 0.91, 0.92), (0.8, 0.84, 0.83), (0.93, 0.92, 0.9), (0.85, 0.83, 0.86), (0.88, 0.88, 0.82)),
        strong=((0.16, 0.4, 0.36), (0.28, 0.33, 0.42), (0.56, 0.42, 0.46), (0.38, 0.38, 0.38)),
        accents=((0.92, 0.74, 0.28), (0.12, 0.46, 0.4), (0.86, 0.5, 0.5), (0.92, 0.92, 0.9), (0.3, 0.36, 0.52)),
        floor=(0.72, 0.63, 0.53),
    ),
    Scheme(  # cherry, mustard and plum
        wood=(0.74, 0.46, 0.3),
        dark=(0.36, 0.2, 0.18),
        walls=((0.96, 0.93, 0.84), (0.9, 0.85, 0.88), (0.93, 0.9, 0.76), (0.82, 0.88, 0.88), (0.95, 0.88, 0.86)),
        strong=((0.45, 0.28, 0.4), (0.78, 0.6, 0.25), (0.26, 0.4, 0.52), (0.66, 0.4, 0.42)),
        accents=((0.52, 0.28, 0.46), (0.86, 0.68, 0.2), (0.24, 0.5, 0.54), (0.95, 0.9, 0.86), (0.8, 0.42, 0.3)),
        floor=(0.72, 0.49, 0.33),
    ),
)


@dataclass(frozen=True, kw_only=True)
class Style:
    """The materials that furniture of one home is made of.

    Attributes:
        scheme: the colours behind them.
        wood: most furniture.
        dark: legs, frames, the darker wood.
        white: painted trim, doors, sanitary ware.
        cloth: large upholstery, by piece.
        accents: cushions, books, vases.
        metal: handles, lamps, taps.
        stone: worktops.
    """

    scheme: Scheme
    wood: Material
    dark: Material
    white: Material
    cloth: tuple[Material, ...]
    accents: tuple[Material, ...]
    metal: Material
    stone: Material


@dataclass(frozen=True, kw_only=True)
class RoomStyle:
    """Surfaces of one room.

    Attributes:
        wall: all walls.
        accent: one wall instead, or None.
        lower: the walls' lower part up to the rail, or None.
        floor: the floor.
        ceiling: the ceiling.
    """

    wall: Material
    accent: Material | None
    lower: Material | None
    floor: Material
    ceiling: Material


def choose_style(rng: np.random.Generator) -> Style:
    """Materials of a whole home."""
    scheme = _SCHEMES[int(rng.integers(len(_SCHEMES)))]
    cover = Texture.LEATHER if rng.random() < 0.25 else Texture.FABRIC
    accents = [scheme.accents[i] for i in rng.permutation(len(scheme.accents))]
    strong = [scheme.strong[i] for i in rng.permutation(len(scheme.strong))]
    pale = tuple(0.55 + 0.45 * value for value in strong[0])
    stone = [(0.92, 0.9, 0.87), (0.42, 0.42, 0.44), (0.75, 0.7, 0.64)][int(rng.integers(3))]
    return Style(
        scheme=scheme,
        wood=Material(texture=Texture.WOOD, tint=scheme.wood, repeat_m=0.7),
        dark=Material(texture=Texture.WOOD, tint=scheme.dark, repeat_m=0.6),
        white=Material(texture=Texture.PLASTER, tint=(0.97, 0.96, 0.94), repeat_m=1.5),
        cloth=(
            Material(texture=cover, tint=strong[0], repeat_m=0.5),
            Material(texture=Texture.FABRIC, tint=strong[1], repeat_m=0.5),
            Material(texture=Texture.FABRIC, tint=(pale[0], pale[1], pale[2]), repeat_m=0.5),
        ),
        accents=tuple(Material(texture=Texture.FABRIC, tint=tint, repeat_m=0.4) for tint in accents),
        metal=Material(texture=Texture.METAL, tint=(0.8, 0.79, 0.77), repeat_m=0.5),
        stone=Material(texture=Texture.STONE, tint=stone, repeat_m=1.2),
    )


def choose_room_style(rng: np.random.Generator, room: Room, style: Style, number: int) -> RoomStyle:
    """Walls, floor and ceiling of one room; `number` keeps neighbouring rooms from the same tint."""
    scheme = style.scheme
    tint = scheme.walls[number % len(scheme.walls)]
    wall = Material(texture=Texture.PLASTER, tint=tint, repeat_m=2.0)
    ceiling = Material(texture=Texture.PLASTER, tint=(0.97, 0.97, 0.96), repeat_m=3.0)
    accent = lower = None
    strong = scheme.strong[int(rng.integers(len(scheme.strong)))]
    chance = rng.random()
    if room.kind == "bath":
        lower = Material(texture=Texture.WALL_TILES, tint=_pale(strong, 0.45), repeat_m=1.2)
    elif room.kind == "kitchen":
        accent = Material(texture=Texture.BRICK, repeat_m=1.0) if chance < 0.4 else Material(tint=strong)
    elif chance < 0.35:
        wall = Material(texture=_WALLPAPERS[int(rng.integers(3))], tint=tint, repeat_m=0.7)
    elif chance < 0.7:
        accent = Material(texture=Texture.PLASTER, tint=_pale(strong, 0.2), repeat_m=2.0)
    else:
        lower = Material(texture=Texture.PLASTER, tint=_pale(strong, 0.35), repeat_m=2.0)
    return RoomStyle(wall=wall, accent=accent, lower=lower, floor=_floor(rng, room, style), ceiling=ceiling)


def _floor(rng: np.random.Generator, room: Room, style: Style) -> Material:
    if room.kind in ("bath", "kitchen"):
        tint = [(0.86, 0.84, 0.8), (0.62, 0.63, 0.65), (0.82, 0.68, 0.56)][int(rng.integers(3))]
        return Material(texture=Texture.TILES, tint=tint, repeat_m=1.6)
    if room.kind == "bedroom" and rng.random() < 0.4:
        return Material(
            texture=Texture.CARPET, tint=_pale(style.scheme.strong[int(rng.integers(4))], 0.4), repeat_m=0.9
        )
    if room.kind in ("living", "study") and rng.random() < 0.35:
        return Material(texture=Texture.PARQUET, tint=style.scheme.floor, repeat_m=2.0)
    return Material(texture=Texture.PLANKS, tint=style.scheme.floor, repeat_m=1.8)


def _pale(colour: Colour, towards_white: float) -> Colour:
    r, g, b = (value + (0.97 - value) * towards_white for value in colour)
    return r, g, b
