"""Shelves, wardrobes, chests, the television's bench, coat racks."""

import numpy as np

from wsm_data.synth.home.furniture.decor import books_standing, vase
from wsm_data.synth.home.furniture.piece import Piece, group, move, piece
from wsm_data.synth.home.solids import block, cushion, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Surface, Texture, parallelogram, placed


def bookshelf(rng: np.random.Generator, style: Style, width_m: float, height_m: float) -> Piece:
    """An open shelf with books and a few other things."""
    depth, board = 0.3, 0.022
    wood = style.wood if rng.random() < 0.7 else style.white
    parts = [block((0, 0.008), 0.0, (width_m, 0.016, height_m), wood, skip=("-y", "-z"))]
    parts += [block((s * (width_m - board) / 2, depth / 2), 0.0, (board, depth, height_m), wood) for s in (-1, 1)]
    count = max(2, round(height_m / 0.36))
    gap = (height_m - 0.08) / count
    for i in range(count + 1):
        z = min(0.06 + i * gap, height_m - board)
        parts.append(block((0, depth / 2), z, (width_m - 2 * board, depth, board), wood))
        if i < count and rng.random() < 0.88:
            row = books_standing(rng, style, width_m - 2 * board, gap - board, depth - 0.04)
            parts.append(placed(row, (-width_m / 2 + board, depth - 0.03, z + board)))
    parts.append(block((0, depth - 0.02), 0.0, (width_m - 2 * board, 0.016, 0.06), wood, skip=("-z",)))
    return piece(parts, width_m, depth, height_m)


def _fronts(
    width: float, depth: float, z0: float, z1: float, columns: int, rows: int, front: Material, handle: Material
) -> list[Surface]:
    """Doors or drawers on the face at y = depth, with their handles."""
    parts = []
    w, h = width / columns, (z1 - z0) / rows
    for i in range(columns):
        for j in range(rows):
            x, z = -width / 2 + w * (i + 0.5), z0 + h * j
            parts.append(block((x, depth + 0.009), z + 0.006, (w - 0.012, 0.018, h - 0.012), front, skip=("-y",)))
            if h > w:
                side = x + (0.5 * w - 0.05) * (1 if i % 2 == 0 else -1)
                parts.append(block((side, depth + 0.03), z + h * 0.5 - 0.08, (0.014, 0.02, 0.16), handle))
            else:
                parts.append(block((x, depth + 0.03), z + h * 0.62, (0.14, 0.02, 0.014), handle))
    return parts


def wardrobe(rng: np.random.Generator, style: Style, width_m: float) -> Piece:
    """A wardrobe with hinged doors."""
    depth, height = 0.6, float(rng.uniform(1.95, 2.2))
    body = style.wood if rng.random() < 0.6 else style.white
    parts = [block((0, depth / 2), 0.05, (width_m, depth, height - 0.05), body)]
    parts.append(block((0, depth / 2 - 0.03), 0.0, (width_m - 0.04, depth - 0.08, 0.05), style.dark, skip=("-z", "+z")))
    parts += _fronts(width_m - 0.02, depth, 0.07, height - 0.03, max(2, round(width_m / 0.5)), 1, body, style.metal)
    parts.append(block((0, depth / 2), height, (width_m + 0.04, depth + 0.04, 0.03), body))
    return piece(parts, width_m + 0.04, depth + 0.05, height)


def chest(rng: np.random.Generator, style: Style, width_m: float, height_m: float) -> Piece:
    """A chest of drawers on short legs, something on top."""
    depth = 0.44
    wood = style.wood if rng.random() < 0.6 else style.dark
    parts = [block((0, depth / 2), 0.14, (width_m, depth, height_m - 0.14), wood)]
    for sx in (-1, 1):
        parts += [
            tube((sx * (width_m / 2 - 0.07), y, 0), (sx * (width_m / 2 - 0.09), y, 0.15), 0.02, style.dark, 6)
            for y in (0.07, depth - 0.07)
        ]
    rows = max(1, round((height_m - 0.2) / 0.2))
    parts += _fronts(
        width_m - 0.03, depth, 0.16, height_m - 0.03, max(1, round(width_m / 0.6)), rows, wood, style.metal
    )
    body = piece(parts, width_m, depth + 0.04, height_m)
    thing = vase(rng, style.accents[int(rng.integers(5))])
    return group([body, move(thing, (float(rng.uniform(-0.3, 0.3)) * width_m, depth / 2), 0.0, height_m)])


def television(rng: np.random.Generator, style: Style) -> Piece:
    """A low bench with a screen on it."""
    width, depth, height = float(rng.uniform(1.4, 1.8)), 0.42, float(rng.uniform(0.42, 0.52))
    parts = [block((0, depth / 2), 0.12, (width, depth, height - 0.12), style.wood)]
    for sx in (-1, 1):
        parts += [
            block((sx * (width / 2 - 0.08), y), 0.0, (0.04, 0.04, 0.12), style.dark) for y in (0.08, depth - 0.08)
        ]
    parts += _fronts(width - 0.02, depth, 0.13, height - 0.02, 3, 1, style.wood, style.metal)
    screen = Material(texture=Texture.SCREEN, emission=0.35, tint=(1.2, 1.2, 1.2))
    black = Material(tint=(0.08, 0.08, 0.09))
    wide, tall, z = 1.15, 0.66, height + 0.06
    parts.append(block((0, 0.2), height, (0.4, 0.2, 0.015), black))
    parts.append(block((0, 0.17), height + 0.01, (0.08, 0.03, 0.08), black))
    parts.append(block((0, 0.18), z, (wide, 0.04, tall), black))
    parts.append(parallelogram((wide / 2, 0.2015, z), (-wide, 0, 0), (0, 0, tall), screen, fit=True))
    return piece(parts, width, depth + 0.04, height + 0.75)


def coat_rack(rng: np.random.Generator, style: Style) -> Piece:
    """A board with hooks and coats above a low bench with shoes."""
    width = 0.9
    parts = [block((0, 0.015), 1.62, (width, 0.03, 0.12), style.wood, skip=("-y",))]
    for i in range(4):
        x = -width / 2 + width * (i + 0.5) / 4
        parts.append(tube((x, 0.03, 1.66), (x, 0.09, 1.7), 0.01, style.metal, 5))
        if rng.random() < 0.7:
            cloth = style.accents[int(rng.integers(5))]
            parts.append(cushion((x, 0.11, 1.22), (0.2, 0.15, 0.86), cloth, 0.6))
    parts += [block((0, 0.17), 0.4, (width, 0.32, 0.04), style.wood)]
    parts += [block((s * (width / 2 - 0.03), 0.17), 0.0, (0.04, 0.3, 0.4), style.wood) for s in (-1, 1)]
    for x in (-0.28, -0.12, 0.12, 0.25):
        parts.append(cushion((x, 0.17, 0.05), (0.1, 0.27, 0.1), style.accents[int(rng.integers(5))], 0.6, 5, 9))
    return piece(parts, width, 0.34, 1.75)
