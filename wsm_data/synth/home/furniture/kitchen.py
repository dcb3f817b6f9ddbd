"""Kitchens: a run of units along a wall, a refrigerator, an island."""

import numpy as np

from wsm_data.synth.home.furniture.decor import bowl, vase
from wsm_data.synth.home.furniture.piece import Piece, group, move, piece
from wsm_data.synth.home.furniture.seating import stool
from wsm_data.synth.home.solids import block, cushion, lathe, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Surface, Texture, placed

_DARK = Material(tint=(0.1, 0.1, 0.11))
_DEPTH_M = 0.6
_WORKTOP_M = 0.9


def kitchen_run(rng: np.random.Generator, style: Style, length_m: float, high: bool) -> Piece:
    """Base units with sink and stove; when `high`, with units above them and a refrigerator at the end."""
    strong = Material(texture=Texture.PLASTER, tint=style.scheme.strong[int(rng.integers(4))])
    front = style.white if rng.random() < 0.4 else strong
    x0 = -length_m / 2
    parts: list[Surface] = []
    if high:
        parts += _fridge(x0 + 0.32)
        x0 += 0.66
    count = max(2, int((length_m / 2 - x0) / 0.58))
    unit = (length_m / 2 - x0) / count
    stove, sink = (int(i) for i in rng.choice(count, 2, replace=False))
    for i in range(count):
        x = x0 + unit * (i + 0.5)
        parts += _base_unit(x, unit, front, style, oven=i == stove)
        if i == stove:
            parts += _hob(x, style)
        elif i == sink:
            parts += _tap(x, style)
        if high:
            parts += _hood(x, style) if i == stove else _wall_unit(x, unit, front, style)
    middle, span = x0 + unit * count / 2, unit * count
    tiles = Material(texture=Texture.WALL_TILES, repeat_m=0.8)
    parts.append(block((middle, _DEPTH_M / 2 + 0.01), _WORKTOP_M - 0.04, (span, _DEPTH_M + 0.03, 0.04), style.stone))
    parts.append(block((middle, 0.006), _WORKTOP_M, (span, 0.012, 0.5 if high else 0.15), tiles, skip=("-y",)))
    body = piece(parts, length_m, _DEPTH_M + 0.03, 2.1 if high else 1.05)
    free = next(i for i in (count - 1, 0, 1) if i != stove)
    fruit = move(bowl(style.accents[1]), (x0 + unit * (free + 0.5), 0.2), 0.0, _WORKTOP_M)
    return group([body, fruit])


def _base_unit(x: float, width: float, front: Material, style: Style, oven: bool) -> list[Surface]:
    parts = [block((x, _DEPTH_M / 2 - 0.02), 0.1, (width, _DEPTH_M - 0.04, 0.76), front)]
    parts.append(block((x, _DEPTH_M / 2 - 0.06), 0.0, (width, _DEPTH_M - 0.12, 0.1), _DARK, skip=("-z", "+z")))
    face = _DEPTH_M - 0.04
    if oven:
        parts.append(block((x, face + 0.01), 0.2, (width - 0.03, 0.02, 0.6), style.metal))
        parts.append(block((x, face + 0.022), 0.3, (width - 0.14, 0.006, 0.28), _DARK))
        parts.append(
            tube(
                (x - width / 2 + 0.08, face + 0.05, 0.68),
                (x + width / 2 - 0.08, face + 0.05, 0.68),
                0.01,
                style.metal,
                6,
            )
        )
        return parts
    for z0, z1 in ((0.12, 0.68), (0.69, 0.85)):
        parts.append(block((x, face + 0.009), z0, (width - 0.012, 0.018, z1 - z0), front, skip=("-y",)))
        parts.append(block((x, face + 0.03), z1 - 0.06, (0.14, 0.02, 0.012), style.metal))
    return parts


def _wall_unit(x: float, width: float, front: Material, style: Style) -> list[Surface]:
    parts = [block((x, 0.17), 1.42, (width, 0.34, 0.68), front)]
    parts.append(block((x, 0.349), 1.43, (width - 0.012, 0.018, 0.66), front, skip=("-y",)))
    parts.append(block((x + width * 0.36, 0.37), 1.46, (0.012, 0.02, 0.14), style.metal))
    return parts


def _hob(x: float, style: Style) -> list[Surface]:
    parts = [block((x, 0.31), _WORKTOP_M, (0.52, 0.46, 0.006), _DARK)]
    for dx, dy, r in ((-0.13, 0.2, 0.08), (0.13, 0.2, 0.06), (-0.13, 0.42, 0.06), (0.13, 0.42, 0.08)):
        ring = lathe([(r, 0.0), (r, 0.008), (r, 0.008), (0.0, 0.008)], Material(tint=(0.3, 0.28, 0.28)), 14)
        parts.append(placed(ring, (x + dx, dy, _WORKTOP_M + 0.006)))
    pot = [(0.09, 0.0), (0.09, 0.12), (0.09, 0.12), (0.0, 0.125)]
    parts.append(placed(lathe(pot, style.metal, 16), (x - 0.13, 0.2, _WORKTOP_M + 0.014)))
    return parts


def _hood(x: float, style: Style) -> list[Surface]:
    parts = [block((x, 0.24), 1.5, (0.58, 0.46, 0.07), style.metal)]
    parts.append(block((x, 0.14), 1.57, (0.26, 0.26, 0.6), style.metal))
    return parts


def _tap(x: float, style: Style) -> list[Surface]:
    basin = block((x, 0.32), _WORKTOP_M, (0.46, 0.36, 0.004), style.metal)
    inner = block(
        (x, 0.32), _WORKTOP_M + 0.002, (0.4, 0.3, 0.004), Material(texture=Texture.METAL, tint=(0.45, 0.46, 0.47))
    )
    parts = [basin, inner, tube((x, 0.1, _WORKTOP_M), (x, 0.1, _WORKTOP_M + 0.28), 0.014, style.metal)]
    parts.append(tube((x, 0.1, _WORKTOP_M + 0.28), (x, 0.26, _WORKTOP_M + 0.26), 0.012, style.metal))
    return parts


def _fridge(x: float) -> list[Surface]:
    body = Material(texture=Texture.METAL, tint=(0.86, 0.87, 0.88), repeat_m=0.8)
    handle = Material(tint=(0.35, 0.35, 0.36))
    parts = [block((x, 0.31), 0.04, (0.62, 0.62, 1.76), body), block((x, 0.28), 0.0, (0.6, 0.54, 0.05), _DARK)]
    for z0, z1 in ((0.06, 0.66), (0.68, 1.78)):
        parts.append(block((x, 0.635), z0, (0.61, 0.03, z1 - z0), body, skip=("-y",)))
        parts.append(block((x + 0.24, 0.67), z1 - 0.45 if z0 > 0.5 else z1 - 0.3, (0.02, 0.04, 0.26), handle))
    return parts


def island(rng: np.random.Generator, style: Style) -> Piece:
    """A free-standing worktop with stools."""
    width, depth = 1.5, 0.7
    front = Material(texture=Texture.PLASTER, tint=style.scheme.strong[int(rng.integers(4))])
    parts = [
        block((0, depth / 2), 0.08, (width - 0.1, depth - 0.16, 0.78), front),
        block((0, depth / 2), 0.0, (width - 0.16, depth - 0.22, 0.08), _DARK, skip=("-z",)),
        block((0, depth / 2), 0.86, (width, depth, 0.045), style.stone),
    ]
    items = [piece(parts, width, depth, 0.91)]
    for x in (-0.42, 0.42):
        items.append(move(stool(style.wood, 0.66), (x, depth - 0.02), 0.0))
    items.append(move(vase(rng, style.accents[3]), (0.4, depth / 2), 0.0, 0.905))
    return group(items)


def waste_bin() -> Piece:
    """A pedal bin."""
    steel = Material(texture=Texture.METAL, tint=(0.7, 0.71, 0.72), repeat_m=0.4)
    shape = [(0.14, 0.0), (0.15, 0.5), (0.15, 0.5), (0.14, 0.55), (0.0, 0.58)]
    lid = cushion((0, 0.17, 0.54), (0.3, 0.3, 0.06), _DARK, 0.8, 5, 12)
    return piece([placed(lathe(shape, steel, 16), (0, 0.17, 0)), lid], 0.32, 0.34, 0.58)
