"""Bathrooms: tub, shower, toilet, basin."""

import numpy as np

from wsm_data.synth.home.furniture.decor import wall_mirror
from wsm_data.synth.home.furniture.piece import Piece, group, piece
from wsm_data.synth.home.solids import block, cushion, lathe, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Surface, Texture, placed

_CERAMIC = Material(tint=(0.97, 0.97, 0.96))


def bathtub(style: Style) -> Piece:
    """A tub along the wall, its water a darker plane inside the rim."""
    width, depth, height = 1.65, 0.74, 0.56
    water = Material(texture=Texture.STONE, tint=(0.72, 0.84, 0.88), repeat_m=1.0)
    parts = [block((0, depth / 2), 0.0, (width, depth, height - 0.03), _CERAMIC, skip=("-z", "+z"))]
    rim = 0.07
    for x, y, w, d in (
        (0, rim / 2, width, rim),
        (0, depth - rim / 2, width, rim),
        (-width / 2 + rim / 2, depth / 2, rim, depth - 2 * rim),
        (width / 2 - rim / 2, depth / 2, rim, depth - 2 * rim),
    ):
        parts.append(block((x, y), height - 0.14, (w, d, 0.14), _CERAMIC))
    parts.append(block((0, depth / 2), height - 0.16, (width - 2 * rim, depth - 2 * rim, 0.02), water, skip=("-z",)))
    parts.append(tube((width / 2 - 0.2, 0.02, 0.75), (width / 2 - 0.2, 0.16, 0.72), 0.016, style.metal))
    return piece(parts, width, depth, height)


def shower(style: Style) -> Piece:
    """A tray in the corner with a rail, a head and a curtain of glass bars."""
    side = 0.9
    tray = Material(texture=Texture.STONE, tint=(0.93, 0.93, 0.93))
    parts = [block((0, side / 2), 0.0, (side, side, 0.06), tray, skip=("-z",))]
    parts.append(tube((0.2, 0.05, 0.9), (0.2, 0.05, 2.05), 0.012, style.metal))
    parts.append(placed(lathe([(0.1, 0.0), (0.09, 0.02), (0.0, 0.03)], style.metal, 14), (0.2, 0.18, 2.03)))
    parts.append(tube((0.2, 0.05, 2.05), (0.2, 0.18, 2.05), 0.01, style.metal))
    for x in (-side / 2 + 0.01, side / 2 - 0.01):
        parts.append(tube((x, side - 0.01, 0.06), (x, side - 0.01, 2.0), 0.012, style.metal))
    parts.append(tube((-side / 2, side - 0.01, 2.0), (side / 2, side - 0.01, 2.0), 0.012, style.metal))
    return piece(parts, side, side, 2.05)


def toilet() -> Piece:
    """A bowl with its cistern."""
    parts = [
        block((0, 0.09), 0.36, (0.38, 0.17, 0.4), _CERAMIC),
        block((0, 0.09), 0.76, (0.4, 0.19, 0.03), _CERAMIC),
        cushion((0, 0.42, 0.37), (0.37, 0.5, 0.09), _CERAMIC, 0.7, 6, 16),
        cushion((0, 0.4, 0.2), (0.26, 0.42, 0.4), _CERAMIC, 0.55, 6, 14),
    ]
    return piece(parts, 0.42, 0.68, 0.8)


def basin(rng: np.random.Generator, style: Style) -> Piece:
    """A cabinet with a bowl and a mirror above it."""
    width, depth = float(rng.uniform(0.7, 1.0)), 0.46
    front = style.wood if rng.random() < 0.6 else style.white
    parts = [block((0, depth / 2), 0.22, (width, depth, 0.6), front)]
    parts += [block((s * width / 4, depth + 0.008), 0.25, (width / 2 - 0.02, 0.016, 0.54), front) for s in (-1, 1)]
    parts += [block((s * 0.05, depth + 0.025), 0.5, (0.012, 0.02, 0.14), style.metal) for s in (-1, 1)]
    parts.append(block((0, depth / 2 + 0.01), 0.82, (width + 0.02, depth + 0.03, 0.03), style.stone))
    bowl = [(0.08, 0.0), (0.16, 0.03), (0.21, 0.11), (0.21, 0.11), (0.19, 0.1), (0.0, 0.03)]
    parts.append(placed(lathe(bowl, _CERAMIC, 18), (0, 0.26, 0.85)))
    parts += _mixer(style)
    return group([piece(parts, width, depth + 0.04, 0.97), wall_mirror(style, (width - 0.1, 0.75), 1.5)])


def _mixer(style: Style) -> list[Surface]:
    return [
        tube((0, 0.05, 0.85), (0, 0.05, 1.05), 0.013, style.metal),
        tube((0, 0.05, 1.05), (0, 0.18, 1.03), 0.011, style.metal),
    ]


def towel_rail(style: Style) -> Piece:
    """A heated rail with a towel over it, flat on the wall."""
    parts = [tube((s * 0.22, 0.05, 0.7), (s * 0.22, 0.05, 1.6), 0.012, style.metal, 6) for s in (-1, 1)]
    parts += [
        tube((-0.22, 0.05, float(z)), (0.22, 0.05, float(z)), 0.009, style.metal, 6) for z in np.linspace(0.75, 1.55, 8)
    ]
    towel = Material(texture=Texture.FABRIC, tint=style.accents[2].tint, repeat_m=0.3)
    parts.append(cushion((0, 0.06, 1.15), (0.36, 0.07, 0.62), towel, 0.3))
    return piece(parts, 0.5, 0.1, 1.6)
