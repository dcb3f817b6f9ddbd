"""Sofas, armchairs, chairs, stools."""

import numpy as np

from wsm_data.synth.home.furniture.piece import Piece, piece
from wsm_data.synth.home.solids import block, cushion, lathe, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Surface, placed


def sofa(rng: np.random.Generator, style: Style, width_m: float, cloth: Material) -> Piece:
    """A sofa with arms, seat and back cushions and a few loose ones; its feet lift it 0.12 m."""
    depth, arm, seats = 0.92, 0.2, max(1, round((width_m - 0.4) / 0.72))
    parts = [block((0, depth / 2), 0.12, (width_m, depth - 0.04, 0.2), cloth)]
    parts.append(cushion((0, 0.13, 0.48), (width_m - 0.1, 0.26, 0.72), cloth, 0.2))
    for sign in (-1, 1):
        parts.append(cushion((sign * (width_m - arm) / 2, depth / 2, 0.37), (arm, depth, 0.52), cloth, 0.25))
        parts += [
            tube((sign * (width_m / 2 - 0.12), y, 0), (sign * (width_m / 2 - 0.12), y, 0.13), 0.022, style.dark)
            for y in (0.1, depth - 0.12)
        ]
    inner = width_m - 2 * arm
    for i in range(seats):
        x = -inner / 2 + inner * (i + 0.5) / seats
        parts.append(cushion((x, 0.55, 0.4), (inner / seats - 0.01, 0.72, 0.2), cloth, 0.25))
        parts.append(cushion((x, 0.29, 0.64), (inner / seats - 0.03, 0.2, 0.46), cloth, 0.35))
    for x in rng.uniform(-inner / 2 + 0.15, inner / 2 - 0.15, int(rng.integers(1, 4))):
        loose = cushion((0, 0, 0), (0.42, 0.14, 0.4), style.accents[int(rng.integers(5))], 0.5)
        parts.append(placed(loose, (float(x), 0.44, 0.68), float(rng.uniform(-0.3, 0.3))))
    return piece(parts, width_m, depth, 0.88)


def armchair(style: Style, cloth: Material) -> Piece:
    """A rounded armchair on thin legs, 0.16 m above the floor."""
    parts = [
        cushion((0, 0.42, 0.34), (0.7, 0.7, 0.34), cloth, 0.3),
        cushion((0, 0.12, 0.62), (0.66, 0.2, 0.62), cloth, 0.4),
        cushion((0, 0.45, 0.5), (0.5, 0.56, 0.14), cloth, 0.3),
    ]
    for sign in (-1, 1):
        parts.append(cushion((sign * 0.31, 0.42, 0.48), (0.13, 0.66, 0.34), cloth, 0.35))
        for y in (0.14, 0.68):
            parts.append(tube((sign * 0.3, y, 0), (sign * 0.24, 0.42 + (y - 0.42) * 0.8, 0.22), 0.018, style.dark, 6))
    return piece(parts, 0.76, 0.8, 0.92)


def chair(wood: Material, seat: Material) -> Piece:
    """A dining chair: four legs, a seat at 0.45 m, a slatted back."""
    parts = [cushion((0, 0.23, 0.455), (0.44, 0.42, 0.06), seat, 0.25, 4, 12)]
    parts.append(block((0, 0.23), 0.4, (0.4, 0.4, 0.035), wood))
    for sign in (-1, 1):
        x = sign * 0.18
        parts.append(tube((x, 0.4, 0), (x, 0.39, 0.41), 0.018, wood, 6))
        parts.append(tube((x, 0.02, 0), (x, 0.06, 0.43), 0.018, wood, 6))
        parts.append(tube((x, 0.06, 0.43), (x, 0.0, 0.9), 0.016, wood, 6))
        parts.append(tube((x, 0.05, 0.2), (x, 0.4, 0.2), 0.011, wood, 5))
    parts += [_slat(z, wood) for z in (0.58, 0.7, 0.83)]
    return piece(parts, 0.44, 0.46, 0.92)


def _slat(z: float, wood: Material) -> Surface:
    return block((0, 0.03), z, (0.36, 0.02, 0.07), wood)


def office_chair(style: Style, cloth: Material) -> Piece:
    """A swivel chair on a star of five feet, lower than 0.1 m at the rim."""
    parts = [
        cushion((0, 0.34, 0.47), (0.5, 0.5, 0.1), cloth, 0.4),
        cushion((0, 0.1, 0.82), (0.46, 0.1, 0.56), cloth, 0.45),
        tube((0, 0.34, 0.08), (0, 0.34, 0.44), 0.03, style.metal),
        block((0, 0.12), 0.42, (0.06, 0.1, 0.2), style.dark),
    ]
    for angle in np.arange(5) * 2 * np.pi / 5:
        tip = (0.28 * float(np.cos(angle)), 0.34 + 0.28 * float(np.sin(angle)), 0.07)
        parts.append(tube((0, 0.34, 0.1), tip, 0.02, style.metal, 6))
        parts.append(cushion((tip[0], tip[1], 0.03), (0.05, 0.05, 0.06), style.dark, 1.0, 4, 6))
    return piece(parts, 0.58, 0.64, 1.1)


def stool(wood: Material, height_m: float = 0.46) -> Piece:
    """A round stool on four splayed legs."""
    top = [(0.0, height_m - 0.035), (0.17, height_m - 0.035), (0.17, height_m - 0.035), (0.175, height_m - 0.015)]
    parts = [placed(lathe([*top, (0.17, height_m), (0.17, height_m), (0.0, height_m)], wood), (0, 0.18, 0))]
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot, head = (sx * 0.15, 0.18 + sy * 0.15, 0.0), (sx * 0.09, 0.18 + sy * 0.09, height_m - 0.03)
            parts.append(tube(foot, head, 0.016, wood, 6))
    return piece(parts, 0.36, 0.36, height_m)
