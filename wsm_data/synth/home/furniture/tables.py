"""Tables of every height: some robots drive under them, others must go round."""

import numpy as np

from wsm_data.synth.home.furniture.decor import books_lying, bowl, laptop, table_lamp, vase
from wsm_data.synth.home.furniture.piece import Piece, group, move, piece
from wsm_data.synth.home.furniture.seating import chair, office_chair
from wsm_data.synth.home.solids import block, lathe, tube
from wsm_data.synth.home.style import Style
from wsm_data.synth.render.surface import Material, Surface, placed


def table(size_m: tuple[float, float, float], top: Material, legs: Material, leg_m: float = 0.06) -> Piece:
    """A rectangular table with a free space below its frame."""
    width, depth, height = size_m
    parts = [block((0, depth / 2), height - 0.035, (width, depth, 0.035), top)]
    inset = leg_m / 2 + 0.03
    for sx in (-1, 1):
        for y in (inset, depth - inset):
            parts.append(block((sx * (width / 2 - inset), y), 0.0, (leg_m, leg_m, height - 0.035), legs, skip=("-z",)))
    for y in (inset, depth - inset):
        parts.append(block((0, y), height - 0.1, (width - 2 * inset, 0.025, 0.065), legs))
    for sx in (-1, 1):
        parts.append(
            block((sx * (width / 2 - inset), depth / 2), height - 0.1, (0.025, depth - 2 * inset, 0.065), legs)
        )
    return piece(parts, width, depth, height)


def round_table(radius_m: float, height_m: float, top: Material, foot: Material) -> Piece:
    """A round table on one turned column."""
    r, h = radius_m, height_m
    plate = [(0.0, h - 0.035), (r, h - 0.035), (r, h - 0.035), (r, h), (r, h), (0.0, h)]
    base = 0.5 * r
    column = [
        (base, 0.0),
        (base, 0.03),
        (0.7 * base, 0.05),
        (0.05, 0.12),
        (0.035, 0.35 * h),
        (0.05, 0.6 * h),
        (0.04, h - 0.05),
    ]
    parts = [placed(lathe(plate, top, 24), (0, r, 0)), placed(lathe([*column, (0.12, h - 0.035)], foot, 16), (0, r, 0))]
    return piece(parts, 2 * r, 2 * r, h)


def dining_set(rng: np.random.Generator, style: Style, seats: int) -> Piece:
    """A dining table with chairs around it, some pulled back, and something on the table."""
    wood = style.wood if rng.random() < 0.6 else style.dark
    seat = style.cloth[int(rng.integers(3))]
    per_side = seats // 2
    width, depth, height = 0.45 + 0.6 * per_side, 0.9, 0.75
    items = [table((width, depth, height), wood, wood)]
    for i in range(per_side):
        x = -width / 2 + width * (i + 0.5) / per_side
        for front in (False, True):
            pulled = float(rng.uniform(-0.05, 0.18))
            yaw = float(rng.normal(0, 0.08))
            y = depth + 0.22 + pulled if front else -0.22 - pulled
            items.append(move(chair(style.dark, seat), (x, y), np.pi + yaw if front else yaw))
    topping = bowl(style.accents[0]) if rng.random() < 0.5 else vase(rng, style.accents[1])
    items.append(move(topping, (0.0, depth / 2), 0.0, height))
    return group(items)


def round_dining_set(rng: np.random.Generator, style: Style) -> Piece:
    """A round table with three or four chairs."""
    radius, height = 0.52, 0.75
    items = [round_table(radius, height, style.wood, style.dark)]
    seat = style.cloth[int(rng.integers(3))]
    count, first = int(rng.integers(3, 5)), float(rng.uniform(0, np.pi))
    for angle in first + np.arange(count) * 2 * np.pi / count:
        reach = radius + 0.24 + float(rng.uniform(-0.05, 0.12))
        x, y = reach * float(np.cos(angle)), radius + reach * float(np.sin(angle))
        items.append(move(chair(style.wood, seat), (x, y), float(angle) + np.pi / 2))
    items.append(move(vase(rng, style.accents[2]), (0.0, radius), 0.0, height))
    return group(items)


def coffee_table(rng: np.random.Generator, style: Style) -> Piece:
    """A low table, with a shelf below or round."""
    height = float(rng.uniform(0.36, 0.46))
    if rng.random() < 0.35:
        base = round_table(0.42, height, style.wood, style.dark)
        things = [move(books_lying(rng, style), (0.05, 0.4), 0.4, height)]
        return group([base, *things])
    width, depth = float(rng.uniform(0.9, 1.2)), 0.58
    items = [table((width, depth, height), style.wood, style.dark, 0.05)]
    items.append(
        piece([block((0, depth / 2), 0.12, (width - 0.12, depth - 0.12, 0.02), style.wood)], width, depth, 0.2)
    )
    items.append(move(books_lying(rng, style), (-width / 4, depth / 2), 0.3, height))
    items.append(move(bowl(style.accents[int(rng.integers(5))]), (width / 5, depth / 2), 0.0, height))
    return group(items)


def side_table(style: Style, lamp: bool) -> Piece:
    """A small table beside a bed or a sofa, with a drawer and perhaps a lamp."""
    parts = [
        block((0, 0.21), 0.3, (0.44, 0.4, 0.22), style.wood),
        block((0, 0.418), 0.33, (0.4, 0.016, 0.16), style.wood),
        block((0, 0.43), 0.41, (0.1, 0.012, 0.012), style.metal),
    ]
    for sx in (-1, 1):
        parts += [tube((sx * 0.19, y, 0), (sx * 0.19, y, 0.31), 0.016, style.dark, 6) for y in (0.04, 0.38)]
    body = piece(parts, 0.46, 0.44, 0.52)
    return group([body, move(table_lamp(style), (0.0, 0.2), 0.0, 0.52)]) if lamp else body


def desk_set(rng: np.random.Generator, style: Style) -> Piece:
    """A desk against the wall with drawers, a computer, a lamp and its chair."""
    width, depth, height = float(rng.uniform(1.2, 1.5)), 0.66, 0.74
    sign = 1 if rng.random() < 0.5 else -1
    items = [table((width, depth, height), style.wood, style.dark, 0.05)]
    items.append(piece(_drawers(sign * (width / 2 - 0.27), style), width, depth, height))
    items.append(move(laptop(style), (-0.1 * sign, 0.3), 0.0, height))
    items.append(move(table_lamp(style), (-sign * (width / 2 - 0.18), 0.18), 0.0, height))
    items.append(move(books_lying(rng, style), (sign * (width / 2 - 0.25), 0.2), 0.0, height))
    seat = move(office_chair(style, style.cloth[1]), (-0.1 * sign, depth + 0.62), np.pi + float(rng.normal(0, 0.25)))
    return group([*items, seat])


def _drawers(x: float, style: Style) -> list[Surface]:
    parts = [block((x, 0.32), 0.06, (0.38, 0.54, 0.58), style.wood)]
    for i in range(3):
        parts.append(block((x, 0.595), 0.09 + 0.185 * i, (0.35, 0.015, 0.165), style.wood))
        parts.append(block((x, 0.608), 0.17 + 0.185 * i, (0.12, 0.012, 0.012), style.metal))
    return parts


def console(rng: np.random.Generator, style: Style) -> Piece:
    """A narrow table for the hall."""
    body = table((0.95, 0.3, 0.8), style.wood, style.dark, 0.035)
    return group([body, move(vase(rng, style.accents[int(rng.integers(5))]), (0.25, 0.15), 0.0, 0.8)])
