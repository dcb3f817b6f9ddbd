"""Small things that make a home: lamps, plants, books, vases, pictures, rugs, curtains."""

import numpy as np

from wsm_data.synth.home.furniture.piece import Lamp, Piece, piece
from wsm_data.synth.home.solids import block, cushion, lathe, sheet, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Colour, Material, Surface, Texture, join, parallelogram, placed

WARM: Colour = (1.0, 0.82, 0.6)
_PICTURES = tuple(texture for texture in Texture if texture.name.startswith("PICTURE"))
_RUGS = (Texture.RUG_BORDER, Texture.RUG_GEOMETRIC, Texture.RUG_STRIPED)


def _shade(low: float, high: float, z0: float, z1: float) -> Surface:
    """A lamp's shade, glowing."""
    glow = Material(texture=Texture.FABRIC, tint=(1.25, 1.12, 0.9), emission=0.95, two_sided=True, repeat_m=0.5)
    return lathe([(low, z0), (high, z1)], glow, 16)


def _lamp(z_m: float, strength: float, radius_m: float = 0.1) -> Lamp:
    r, g, b = (strength * value for value in WARM)
    return Lamp(xyz_m=(0.0, 0.0, z_m), power=(r, g, b), radius_m=radius_m)


def table_lamp(style: Style) -> Piece:
    """A lamp for a table, its foot at the origin."""
    foot = [(0.08, 0.0), (0.08, 0.015), (0.02, 0.03), (0.045, 0.1), (0.05, 0.16), (0.015, 0.24), (0.012, 0.3)]
    parts = [lathe(foot, style.accents[0], 12), _shade(0.14, 0.09, 0.26, 0.44)]
    return Piece(surface=join(parts), footprints=(), height_m=0.44, lamps=(_lamp(0.34, 0.16),))


def floor_lamp(style: Style) -> Piece:
    """A lamp on a tall stem."""
    base = [(0.14, 0.0), (0.14, 0.02), (0.03, 0.03), (0.012, 0.05), (0.012, 1.35)]
    parts = [lathe(base, style.dark, 12), _shade(0.2, 0.13, 1.3, 1.58)]
    body = placed(join(parts), (0.0, 0.2, 0.0))
    lamp = Lamp(xyz_m=(0.0, 0.2, 1.45), power=(0.5, 0.41, 0.3), radius_m=0.12)
    return piece([body], 0.34, 0.4, 1.6, lamp)


def ceiling_lamp(rng: np.random.Generator, style: Style, ceiling_m: float, drop_m: float, strength: float) -> Piece:
    """A pendant below the ceiling; `drop_m` of 0 is a flat dish."""
    if drop_m == 0.0:
        glow = Material(tint=(1.15, 1.08, 0.95), emission=1.0)
        dish = [(0.0, ceiling_m - 0.1), (0.12, ceiling_m - 0.095), (0.19, ceiling_m - 0.06), (0.2, ceiling_m - 0.005)]
        parts = [lathe(dish, glow, 18)]
        return Piece(surface=join(parts), footprints=(), height_m=0.1, lamps=(_lamp(ceiling_m - 0.2, strength, 0.15),))
    z = ceiling_m - drop_m
    parts = [tube((0, 0, z), (0, 0, ceiling_m), 0.006, style.dark, 5)]
    wide = float(rng.uniform(0.18, 0.26))
    cover = Material(texture=Texture.METAL, tint=(0.9, 0.85, 0.8), two_sided=True, emission=0.25)
    parts.append(lathe([(wide, z - 0.16), (0.8 * wide, z - 0.08), (0.05, z), (0.0, z + 0.01)], cover, 18))
    glow = Material(tint=(1.3, 1.2, 1.0), emission=1.0)
    parts.append(cushion((0, 0, z - 0.11), (0.11, 0.11, 0.11), glow, 1.0, 6, 10))
    return Piece(surface=join(parts), footprints=(), height_m=0.2, lamps=(_lamp(z - 0.2, strength, 0.12),))


def plant(rng: np.random.Generator, style: Style, height_m: float) -> Piece:
    """A pot with long leaves that arch outwards."""
    pot = style.accents[int(rng.integers(5))]
    rim = 0.1 + 0.08 * height_m
    shape = [(0.7 * rim, 0.0), (rim, 0.22 * height_m), (rim, 0.22 * height_m), (0.9 * rim, 0.22 * height_m - 0.01)]
    parts = [lathe(shape, pot, 14)]
    soil = Material(texture=Texture.BARK, repeat_m=0.3)
    parts.append(lathe([(rim, 0.2 * height_m), (0.0, 0.205 * height_m)], soil, 12))
    tint = (float(rng.uniform(0.7, 1.2)), 1.0, float(rng.uniform(0.6, 1.0)))
    blade = Material(texture=Texture.LEAF, tint=tint, two_sided=True)
    count = int(rng.integers(16, 26))
    for i in range(count):
        angle, lift = 2.4 * i + float(rng.uniform(-0.3, 0.3)), (i + 0.5) / count
        parts.append(_leaf(rng, blade, 0.2 * height_m, height_m, angle, lift))
    return piece([placed(join(parts), (0.0, rim + 0.1, 0.0))], 2.4 * rim, 2.4 * rim + 0.1, height_m)


def _leaf(
    rng: np.random.Generator, blade: Material, start_m: float, height_m: float, angle: float, lift: float
) -> Surface:
    """One leaf from the soil: the later ones stand steeper and reach higher."""
    reach = (0.42 - 0.3 * lift) * height_m * float(rng.uniform(0.85, 1.15))
    top = start_m + (0.35 + 0.45 * lift) * height_m * float(rng.uniform(0.85, 1.1))
    width = 0.07 * height_m + 0.004

    def shape(s: "np.ndarray", t: "np.ndarray") -> tuple["np.ndarray", "np.ndarray", "np.ndarray"]:
        outline = np.sin(np.pi * np.clip(t, 0.02, 1.0) ** 0.8) * (1 - 0.3 * t) + 0.03
        side = (s - 0.5) * 2 * width * outline
        out = reach * (0.15 * t + 0.85 * t * t)
        z = start_m + (top - start_m) * (1.9 * t - 1.05 * t * t) + np.abs(s - 0.5) * width * 0.5
        return out, side, z

    return placed(sheet(shape, (2, 6), blade), (0.0, 0.0, 0.0), angle)


def vase(rng: np.random.Generator, material: Material) -> Piece:
    """A vase with a few twigs."""
    tall = float(rng.uniform(0.2, 0.32))
    shape = [(0.045, 0.0), (0.075, 0.35 * tall), (0.06, 0.7 * tall), (0.03, 0.88 * tall), (0.042, tall)]
    parts = [lathe(shape, Material(texture=Texture.STONE, tint=material.tint, repeat_m=0.5), 14)]
    blade = Material(texture=Texture.LEAF, two_sided=True)
    for i in range(7):
        angle = 0.9 * i + float(rng.uniform(-0.2, 0.2))
        parts.append(_leaf(rng, blade, 0.8 * tall, 0.42, angle, float(rng.uniform(0.5, 1.0))))
    return Piece(surface=join(parts), footprints=(), height_m=tall + 0.3)


def bowl(material: Material) -> Piece:
    """A bowl of fruit."""
    shape = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.0), (0.12, 0.04), (0.15, 0.09)]
    parts = [lathe(shape, Material(tint=material.tint, two_sided=True), 16)]
    fruit = ((0.9, 0.5, 0.15), (0.75, 0.2, 0.15), (0.55, 0.65, 0.2), (0.9, 0.75, 0.2))
    for i, tint in enumerate(fruit):
        x, y = 0.055 * float(np.cos(1.6 * i)), 0.055 * float(np.sin(1.6 * i))
        parts.append(cushion((x, y, 0.085), (0.085, 0.085, 0.08), Material(tint=tint), 1.0, 6, 9))
    return Piece(surface=join(parts), footprints=(), height_m=0.14)


def books_lying(rng: np.random.Generator, style: Style) -> Piece:
    """A small pile of books."""
    parts, z = [], 0.0
    for i in range(int(rng.integers(2, 5))):
        size = (float(rng.uniform(0.16, 0.25)), float(rng.uniform(0.13, 0.18)), float(rng.uniform(0.015, 0.035)))
        cover = Material(tint=style.accents[(i + int(rng.integers(5))) % 5].tint)
        parts.append(placed(block((0, 0), z, size, cover), (0, 0, 0), float(rng.uniform(-0.3, 0.3))))
        z += size[2]
    return Piece(surface=join(parts), footprints=(), height_m=z)


def books_standing(rng: np.random.Generator, style: Style, width_m: float, room_m: float, depth_m: float) -> Surface:
    """A row of books from x = 0 on, their backs at y = 0 and their pages behind, with gaps and ornaments."""
    parts, x = [], 0.01
    while x < width_m - 0.07:
        if rng.random() < 0.12:
            x += float(rng.uniform(0.05, 0.14))
            continue
        thick = float(rng.uniform(0.018, 0.05))
        tall, deep = room_m * float(rng.uniform(0.62, 0.93)), depth_m * float(rng.uniform(0.7, 0.95))
        base = (
            style.accents[int(rng.integers(5))].tint
            if rng.random() < 0.7
            else style.scheme.strong[int(rng.integers(4))]
        )
        tone = float(rng.uniform(0.65, 1.05))
        cover = Material(texture=Texture.BOOK, tint=(base[0] * tone, base[1] * tone, base[2] * tone), repeat_m=0.3)
        parts.append(block((x + thick / 2, -deep / 2), 0.0, (thick, deep, tall), cover, skip=("-z", "-y"), fit=("+y",)))
        x += thick + 0.002
    return join(parts)


def laptop(style: Style) -> Piece:
    """An open laptop whose user sits at +y, and a mug."""
    screen = Material(texture=Texture.SCREEN, emission=0.6, tint=(1.6, 1.7, 1.9))
    parts = [
        block((0, 0), 0.0, (0.34, 0.24, 0.018), style.metal),
        block((0, -0.13), 0.018, (0.34, 0.012, 0.22), style.metal, skip=("+y",)),
        parallelogram((0.17, -0.124, 0.018), (-0.34, 0, 0), (0, 0, 0.22), screen, fit=True),
        placed(
            lathe([(0.04, 0.0), (0.04, 0.09)], Material(tint=style.accents[3].tint, two_sided=True), 10), (0.3, 0, 0)
        ),
    ]
    return Piece(surface=join(parts), footprints=(), height_m=0.24)


def rug(rng: np.random.Generator, size_m: tuple[float, float]) -> Piece:
    """A rug, 8 mm thick, its middle at the origin."""
    width, depth = size_m
    material = Material(texture=_RUGS[int(rng.integers(3))])
    edge = Material(texture=Texture.FABRIC, tint=(0.7, 0.62, 0.52), repeat_m=0.4)
    parts = [block((0, 0), 0.0, (width, depth, 0.008), edge, skip=("-z", "+z"))]
    parts.append(parallelogram((-width / 2, -depth / 2, 0.008), (width, 0, 0), (0, depth, 0), material, fit=True))
    return Piece(surface=join(parts), footprints=(), height_m=0.008)


def picture(rng: np.random.Generator, style: Style, size_m: tuple[float, float], z_m: float) -> Piece:
    """A framed painting on the wall behind y = 0, its middle at height `z_m`."""
    width, height = size_m
    art = Material(texture=_PICTURES[int(rng.integers(len(_PICTURES)))])
    frame = style.dark if rng.random() < 0.5 else style.white
    low = z_m - height / 2
    mount = Material(tint=(0.96, 0.95, 0.92))
    parts = [block((0, 0.012), low, (width, 0.024, height), frame, skip=("-y",))]
    for border, depth, material, fit in ((0.022, 0.0245, mount, False), (0.07, 0.0255, art, True)):
        corner, w, h = (width / 2 - border, depth, low + border), width - 2 * border, height - 2 * border
        parts.append(parallelogram(corner, (-w, 0, 0), (0, 0, h), material, fit=fit))
    return Piece(surface=join(parts), footprints=(), height_m=height)


def wall_mirror(style: Style, size_m: tuple[float, float], z_m: float) -> Piece:
    """A mirror on the wall behind y = 0."""
    width, height = size_m
    glass = Material(texture=Texture.MIRROR, emission=0.35)
    low = z_m - height / 2
    parts = [block((0, 0.012), low, (width, 0.024, height), style.dark, skip=("-y",))]
    corner = (width / 2 - 0.03, 0.0245, low + 0.03)
    parts.append(parallelogram(corner, (-(width - 0.06), 0, 0), (0, 0, height - 0.06), glass, fit=True))
    return Piece(surface=join(parts), footprints=(), height_m=height)


def curtains(style: Style, width_m: float, z0_m: float, z1_m: float, cloth: Material) -> Piece:
    """A rod and two gathered curtains beside a window of `width_m`, its wall behind y = 0."""
    reach = width_m / 2 + 0.22
    thin = Material(texture=Texture.FABRIC, tint=cloth.tint, repeat_m=0.5, two_sided=True)
    parts = [tube((-reach, 0.09, z1_m), (reach, 0.09, z1_m), 0.012, style.dark, 6)]
    parts += [cushion((sign * reach, 0.09, z1_m), (0.05, 0.05, 0.05), style.dark, 1.0, 4, 6) for sign in (-1, 1)]
    for sign in (-1, 1):

        def shape(
            s: "np.ndarray", t: "np.ndarray", sign: int = sign
        ) -> tuple["np.ndarray", "np.ndarray", "np.ndarray"]:
            x = sign * (reach - 0.02 - 0.34 * s * (1 - 0.12 * np.sin(np.pi * t)))
            return -x, 0.09 + 0.035 * np.sin(s * 5 * 2 * np.pi), z0_m + (z1_m - z0_m) * t

        parts.append(sheet(shape, (20, 3), thin, (0.8, 4.0)))
    return Piece(surface=join(parts), footprints=(), height_m=z1_m)


def basket(rng: np.random.Generator) -> Piece:
    """A wicker basket."""
    tall = float(rng.uniform(0.3, 0.5))
    weave = Material(texture=Texture.WICKER, tint=(0.82, 0.66, 0.44), repeat_m=0.3, two_sided=True)
    inside = Material(texture=Texture.WICKER, tint=(0.4, 0.32, 0.22), repeat_m=0.3)
    parts = [lathe([(0.16, 0.0), (0.2, 0.5 * tall), (0.18, tall)], weave, 16)]
    parts.append(lathe([(0.18, 0.7 * tall), (0.0, 0.7 * tall)], inside, 12))
    return piece([placed(join(parts), (0.0, 0.22, 0.0))], 0.42, 0.44, tall)
