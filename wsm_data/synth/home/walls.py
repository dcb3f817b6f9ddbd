"""The shell of a home: walls with their openings, floors, ceilings, skirting boards, doors and windows."""

from collections.abc import Sequence

import numpy as np

from wsm_data.synth.home.floor_plan import FloorPlan, Opening, Room, side_of
from wsm_data.synth.home.solids import box
from wsm_data.synth.home.style import RoomStyle, Style
from wsm_data.synth.render.surface import Material, Point, Surface, Texture, join, panel, parallelogram, placed

SIDES = ("south", "north", "west", "east")
RAIL_M = 0.95
_SKIRTING = (0.016, 0.09)  # thickness and height, m; lower than what a robot drives over
_CASING = (0.07, 0.018)  # width and thickness of the boards around an opening, m
LEAF_M = 0.04


def room_shell(room: Room, plan: FloorPlan, look: RoomStyle, style: Style, accent_side: str) -> Surface:
    """Floor, ceiling, walls and skirting of one room."""
    parts = [_floor(room, look.floor), _ceiling(room, plan.ceiling_m, look.ceiling)]
    for side in SIDES:
        holes = sorted((o for o in plan.openings if side_of(o, room) == side), key=lambda o: o.start)
        material = look.accent if look.accent is not None and side == accent_side else look.wall
        parts += _wall(room, side, holes, plan.ceiling_m, material, look.lower, style)
    return join(parts)


def _floor(room: Room, material: Material) -> Surface:
    size = (room.x1 - room.x0, room.y1 - room.y0)
    return panel((room.x0, room.y0, 0.0), (size[0], 0.0, 0.0), (0.0, size[1], 0.0), material)


def _ceiling(room: Room, height: float, material: Material) -> Surface:
    size = (room.x1 - room.x0, room.y1 - room.y0)
    return panel((room.x0, room.y1, height), (size[0], 0.0, 0.0), (0.0, -size[1], 0.0), material)


def _wall(
    room: Room,
    side: str,
    holes: Sequence[Opening],
    ceiling_m: float,
    upper: Material,
    lower: Material | None,
    style: Style,
) -> list[Surface]:
    """One wall: full height between the holes, above and below them, with skirting where it meets the floor."""
    low, high = (room.x0, room.x1) if side in ("south", "north") else (room.y0, room.y1)
    pieces: list[tuple[float, float, float, float]] = []
    position = low
    for hole in holes:
        pieces += [(position, hole.start, 0.0, ceiling_m), (hole.start, hole.end, 0.0, hole.z0)]
        pieces.append((hole.start, hole.end, hole.z1, ceiling_m))
        position = hole.end
    pieces.append((position, high, 0.0, ceiling_m))
    parts = [part for piece in pieces for part in _wall_pieces(room, side, *piece, upper, lower)]
    for a, b in _between_doors(low, high, holes):
        parts.append(_board(room, side, a, b, 0.0, _SKIRTING[1], _SKIRTING[0], style.white))
    if lower is not None:
        rails = [(a, b) for a, b, z0, z1 in pieces if z0 < RAIL_M < z1 and b - a > 0.02]
        parts += [_board(room, side, a, b, RAIL_M - 0.03, RAIL_M + 0.02, 0.02, style.white) for a, b in rails]
    return parts


def _between_doors(low: float, high: float, holes: Sequence[Opening]) -> list[tuple[float, float]]:
    """The stretches of a wall's foot that no door or its casing takes."""
    stretches, position = [], low
    for hole in holes:
        if hole.z0 == 0.0:
            stretches.append((position, hole.start - _CASING[0]))
            position = hole.end + _CASING[0]
    stretches.append((position, high))
    return [(a, b) for a, b in stretches if b - a > 0.02]


def _wall_pieces(
    room: Room, side: str, a: float, b: float, z0: float, z1: float, upper: Material, lower: Material | None
) -> list[Surface]:
    if b - a < 1e-6 or z1 - z0 < 1e-6:
        return []
    if lower is not None and z0 < RAIL_M < z1:
        return [
            wall_panel(room, side, a, b, z0, RAIL_M, lower),
            wall_panel(room, side, a, b, RAIL_M, z1, upper),
        ]
    material = lower if lower is not None and z1 <= RAIL_M else upper
    return [wall_panel(room, side, a, b, z0, z1, material)]


def wall_panel(room: Room, side: str, a: float, b: float, z0: float, z1: float, material: Material) -> Surface:
    """The part of a wall's face between a and b along it and z0 and z1, facing into the room."""
    length, up = b - a, (0.0, 0.0, z1 - z0)
    corners: dict[str, tuple[Point, Point]] = {
        "south": ((b, room.y0, z0), (-length, 0.0, 0.0)),
        "north": ((a, room.y1, z0), (length, 0.0, 0.0)),
        "west": ((room.x0, a, z0), (0.0, length, 0.0)),
        "east": ((room.x1, b, z0), (0.0, -length, 0.0)),
    }
    corner, edge = corners[side]
    return panel(corner, edge, up, material)


def _board(
    room: Room, side: str, a: float, b: float, z0: float, z1: float, thickness: float, material: Material
) -> Surface:
    """A board on a wall's face."""
    if side == "south":
        return box((a, room.y0, z0), (b, room.y0 + thickness, z1), material, skip=("-y", "-z"))
    if side == "north":
        return box((a, room.y1 - thickness, z0), (b, room.y1, z1), material, skip=("+y", "-z"))
    if side == "west":
        return box((room.x0, a, z0), (room.x0 + thickness, b, z1), material, skip=("-x", "-z"))
    return box((room.x1 - thickness, a, z0), (room.x1, b, z1), material, skip=("+x", "-z"))


def opening_surface(opening: Opening, rooms: Sequence[Room], style: Style, floor: Material, view: Texture) -> Surface:
    """What fills and frames a hole: its lining, the casing in the rooms, a threshold or a window."""
    parts = _lining(opening, style.white, floor)
    for room in rooms:
        side = side_of(opening, room)
        if side is not None:
            parts += _casing(opening, room, side, style.white)
    if opening.kind == "window":
        parts += _window(opening, style.white, view)
    return join(parts)


def _at(opening: Opening, along: float, across: float, z: float) -> Point:
    return (along, across, z) if opening.axis == 0 else (across, along, z)


def _lining(opening: Opening, material: Material, floor: Material) -> list[Surface]:
    """The inner faces of the hole."""
    o, depth, height = opening, opening.high - opening.low, opening.z1 - opening.z0
    straight = o.axis == 0  # exchanging x and y mirrors, so the faces of the wall change places
    near, far, inward = (o.low, o.high, depth) if straight else (o.high, o.low, -depth)
    start = (_at(o, o.start, near, o.z0), _at(o, 0.0, inward, 0.0))
    end = (_at(o, o.end, far, o.z0), _at(o, 0.0, -inward, 0.0))
    up = (0.0, 0.0, height)
    low_x, low_y, _ = _at(o, o.start, o.low, 0.0)
    high_x, high_y, _ = _at(o, o.end, o.high, 0.0)
    head = panel((low_x, high_y, o.z1), (high_x - low_x, 0.0, 0.0), (0.0, low_y - high_y, 0.0), material)
    below = material if o.z0 > 0 else floor
    sill = panel((low_x, low_y, o.z0), (high_x - low_x, 0.0, 0.0), (0.0, high_y - low_y, 0.0), below)
    return [panel(*start, up, material), panel(*end, up, material), head, sill]


def _casing(opening: Opening, room: Room, side: str, material: Material) -> list[Surface]:
    o, (width, thickness) = opening, _CASING
    low = o.z0 - (0.03 if o.kind == "window" else 0.0)
    posts = [(o.start - width, o.start), (o.end, o.end + width)]
    parts = [_board(room, side, a, b, low, o.z1 + width, thickness, material) for a, b in posts]
    parts.append(_board(room, side, o.start, o.end, o.z1, o.z1 + width, thickness, material))
    if o.kind == "window":
        parts.append(_board(room, side, o.start - width, o.end + width, o.z0 - 0.04, o.z0, 0.06, material))
    return parts


def _window(opening: Opening, frame: Material, view: Texture) -> list[Surface]:
    """The view behind the glass, and the frame and bars before it."""
    o = opening
    glass = Material(texture=view, emission=1.0, tint=(1.08, 1.08, 1.08))
    face = o.low + 0.05 if o.outside < 0 else o.high - 0.05
    inward = 1.0 if o.outside < 0 else -1.0
    near, far = sorted((face, face + 0.03 * inward))
    across = o.end - o.start
    facing_start = (o.axis == 0) == (o.outside < 0)
    corner = _at(o, o.end if facing_start else o.start, face, o.z0)
    edge = _at(o, -across if facing_start else across, 0.0, 0.0)
    parts = [parallelogram(corner, edge, (0.0, 0.0, o.z1 - o.z0), glass, fit=True)]
    bar = 0.045
    uprights = [o.start, (o.start + o.end - bar) / 2, o.end - bar]
    levels = [o.z0, o.z0 + 0.68 * (o.z1 - o.z0), o.z1 - bar]
    for a in uprights:
        parts.append(_span(o, a, a + bar, near, far, o.z0, o.z1, frame))
    for z in levels:
        parts.append(_span(o, o.start, o.end, near, far, z, z + bar, frame))
    return parts


def _span(o: Opening, a: float, b: float, near: float, far: float, z0: float, z1: float, material: Material) -> Surface:
    return box(_at(o, a, near, z0), _at(o, b, far, z1), material)


def door_leaf(opening: Opening, room: Room, style: Style, colour: Material, angle_rad: float) -> tuple[Surface, Point]:
    """A leaf that stands open in the room, hinged at the end of the hole nearer to the room's side wall.

    Returns:
        The leaf, and (hinge x, hinge y, heading in rad) of its free edge as seen from the hinge.
    """
    o = opening
    side = side_of(o, room)
    low, high = (room.x0, room.x1) if o.axis == 0 else (room.y0, room.y1)
    at_start = o.start - low < high - o.end
    width = o.end - o.start - 0.02
    hinge = _at(o, o.start + 0.005 if at_start else o.end - 0.005, o.high if side in ("south", "west") else o.low, 0.0)
    inward = {"south": np.pi / 2, "north": -np.pi / 2, "west": 0.0, "east": np.pi}[side or "south"]
    closed = (0.0 if at_start else np.pi) if o.axis == 0 else (np.pi / 2 if at_start else -np.pi / 2)
    turn = np.sign(np.sin(inward - closed))
    heading = closed + turn * angle_rad
    return placed(_leaf(width, o.z1 - 0.01, colour, style), hinge, heading), (hinge[0], hinge[1], float(heading))


def _leaf(width: float, height: float, colour: Material, style: Style) -> Surface:
    """A panelled leaf from the hinge along +x."""
    half = LEAF_M / 2
    parts = [box((0.0, -half, 0.01), (width, half, height), colour)]
    for z0, z1 in ((0.18, 0.85), (1.05, height - 0.15)):
        for sign in (-1.0, 1.0):
            y0, y1 = sorted((sign * half, sign * (half + 0.008)))
            parts.append(box((0.13, y0, z0), (width - 0.13, y1, z1), colour))
    for sign in (-1.0, 1.0):
        y0, y1 = sorted((sign * half, sign * (half + 0.05)))
        parts.append(box((width - 0.09, y0, 1.0), (width - 0.07, y1, 1.02), style.metal))
        y0, y1 = sorted((sign * (half + 0.035), sign * (half + 0.05)))
        parts.append(box((width - 0.2, y0, 1.0), (width - 0.07, y1, 1.02), style.metal))
    return join(parts)
