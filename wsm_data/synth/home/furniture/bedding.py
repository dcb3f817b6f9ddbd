"""Beds."""

import numpy as np

from wsm_data.synth.home.furniture.piece import Piece, group, move, piece
from wsm_data.synth.home.furniture.tables import side_table
from wsm_data.synth.home.solids import block, cushion
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Texture


def bed(rng: np.random.Generator, style: Style, width_m: float) -> Piece:
    """A bed with its head at the wall; some stand high enough to look under."""
    length, lift = 2.08, float(rng.choice([0.08, 0.26]))
    wood = style.wood if rng.random() < 0.6 else style.dark
    cover = Material(texture=Texture.DUVET, tint=style.cloth[int(rng.integers(3))].tint, repeat_m=1.1)
    linen = Material(texture=Texture.DUVET, tint=(0.97, 0.96, 0.94), repeat_m=0.8)
    parts = [
        block((0, 0.03), 0.0, (width_m + 0.1, 0.06, float(rng.uniform(0.9, 1.15))), wood, skip=("-z",)),
        block((0, length / 2 + 0.04), lift, (width_m + 0.06, length, 0.14), wood),
        cushion((0, length / 2 + 0.05, lift + 0.22), (width_m, length - 0.04, 0.24), linen, 0.18),
        cushion((0, length / 2 + 0.36, lift + 0.27), (width_m + 0.08, length - 0.66, 0.24), cover, 0.22),
    ]
    for sx in (-1, 1):
        for y in (0.12, length - 0.02):
            parts.append(block((sx * (width_m / 2 - 0.05), y), 0.0, (0.07, 0.07, lift), style.dark, skip=("-z",)))
    pillows = 2 if width_m > 1.2 else 1
    for i in range(pillows):
        x = -width_m / 2 + width_m * (i + 0.5) / pillows
        parts.append(cushion((x, 0.32, lift + 0.4), (0.6, 0.42, 0.16), linen, 0.5))
        parts.append(cushion((x, 0.5, lift + 0.43), (0.4, 0.3, 0.13), style.accents[i], 0.5))
    return piece(parts, width_m + 0.1, length + 0.06, 0.6)


def bed_set(rng: np.random.Generator, style: Style, width_m: float, tables: int) -> Piece:
    """A bed with one or two side tables."""
    items = [bed(rng, style, width_m)]
    sides = [1, -1][:tables] if tables < 2 else [1, -1]
    for sign in sides:
        items.append(move(side_table(style, lamp=True), (sign * (width_m / 2 + 0.32), 0.0), 0.0))
    return group(items)
