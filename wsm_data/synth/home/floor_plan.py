"""Floor plans: rooms along a corridor, the doors between them and the windows to the outside."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

PARTITION_M = 0.12
"""Thickness of the walls between rooms, m."""

FACADE_M = 0.2
"""Thickness of the outer walls, m."""

DOOR_HEAD_M = 2.05
MIN_ROOM_WIDTH_M = 2.7


@dataclass(frozen=True, kw_only=True)
class Room:
    """The clear inside of a room, between the faces of its walls.

    Attributes:
        kind: `living`, `kitchen`, `bedroom`, `study`, `bath` or `hall`.
        x0: smallest x, m.
        y0: smallest y, m.
        x1: largest x, m.
        y1: largest y, m.
    """

    kind: str
    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def area_m2(self) -> float:
        """Floor area, m^2."""
        return (self.x1 - self.x0) * (self.y1 - self.y0)


@dataclass(frozen=True, kw_only=True)
class Opening:
    """A hole in a wall.

    Attributes:
        kind: `door` (with a leaf), `passage` (without) or `window`.
        axis: 0 when the wall runs along x, 1 when along y.
        start: smaller end of the hole along that axis, m.
        end: larger end, m.
        low: the wall's face towards smaller coordinates of the other axis, m.
        high: its face towards larger ones, m.
        z0: lower edge above the floor, m.
        z1: upper edge, m.
        outside: for windows, whether the outside is at `low` (-1) or at `high` (+1); 0 between rooms.
    """

    kind: str
    axis: int
    start: float
    end: float
    low: float
    high: float
    z0: float = 0.0
    z1: float = DOOR_HEAD_M
    outside: int = 0


@dataclass(frozen=True, kw_only=True)
class FloorPlan:
    """A storey.

    Attributes:
        rooms: the first is the hall.
        openings: doors, passages and windows.
        ceiling_m: height of the ceiling above the floor at z = 0, m.
    """

    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]
    ceiling_m: float


def side_of(opening: Opening, room: Room) -> str | None:
    """Which wall of the room the opening is in: `south`, `north`, `west` or `east`; None when in none."""
    along = (room.x0, room.x1) if opening.axis == 0 else (room.y0, room.y1)
    if not (along[0] - 1e-9 <= opening.start and opening.end <= along[1] + 1e-9):
        return None
    across = (room.y0, room.y1) if opening.axis == 0 else (room.x0, room.x1)
    names = ("south", "north") if opening.axis == 0 else ("west", "east")
    if abs(opening.high - across[0]) < 1e-9:
        return names[0]
    if abs(opening.low - across[1]) < 1e-9:
        return names[1]
    return None


def make_floor_plan(rng: np.random.Generator) -> FloorPlan:
    """A home of five to eight rooms, somewhere around the world's origin and never centred on it."""
    open_end = bool(rng.random() < 0.65)
    south, north = float(rng.uniform(3.2, 4.2)), float(rng.uniform(3.2, 4.2))
    hall_0, hall_1 = south + PARTITION_M, south + PARTITION_M + float(rng.uniform(1.35, 1.75))
    depth = hall_1 + PARTITION_M + north
    strip = float(rng.uniform(7.2, 8.6)) if open_end else float(rng.uniform(9.6, 11.4))
    rooms = [Room(kind="hall", x0=0.0, y0=hall_0, x1=strip, y1=hall_1)]
    for number, (y0, y1) in enumerate(((0.0, south), (hall_1 + PARTITION_M, depth))):
        stretches = _split(rng, strip, with_bath=number == 0)
        rooms += [Room(kind="", x0=a, y0=y0, x1=b, y1=y1) for a, b in stretches]
    if open_end:
        end = strip + PARTITION_M + float(rng.uniform(4.2, 5.2))
        rooms.append(Room(kind="living", x0=strip + PARTITION_M, y0=0.0, x1=end, y1=depth))
    named = _name_rooms(rng, rooms)
    openings = [*_doors(rng, named), *_passages(rng, named), *_windows(rng, named)]
    plan = FloorPlan(rooms=tuple(named), openings=tuple(openings), ceiling_m=round(float(rng.uniform(2.5, 2.8)), 2))
    return _turned_and_moved(rng, plan)


def _split(rng: np.random.Generator, length: float, with_bath: bool) -> list[tuple[float, float]]:
    """Two to four stretches of a strip, a partition between neighbours; with a bath the first or last is narrow."""
    bath = [float(rng.uniform(1.9, 2.4))] if with_bath else []
    rest = length - sum(width + PARTITION_M for width in bath)
    most = min(3, int((rest + PARTITION_M) / (MIN_ROOM_WIDTH_M + PARTITION_M)))
    count = most if most < 3 or rng.random() < 0.5 else 2
    spare = rest - count * MIN_ROOM_WIDTH_M - (count - 1) * PARTITION_M
    widths = [MIN_ROOM_WIDTH_M + float(share) * spare for share in rng.dirichlet(np.full(count, 3.0))]
    widths = widths + bath if rng.random() < 0.5 else bath + widths
    stretches, start = [], 0.0
    for width in widths:
        stretches.append((start, start + width))
        start += width + PARTITION_M
    stretches[-1] = (stretches[-1][0], length)  # rounding must not leave a slit
    return stretches


def _name_rooms(rng: np.random.Generator, rooms: Sequence[Room]) -> list[Room]:
    """Give every strip room its purpose by size: the largest to live in, the smallest to bathe in."""
    unnamed = sorted((i for i, room in enumerate(rooms) if not room.kind), key=lambda i: -rooms[i].area_m2)
    kinds = [] if any(room.kind == "living" for room in rooms) else ["living"]
    rest = ["bedroom", "study", "bedroom", "study", "bedroom"]
    if rng.random() < 0.5:
        rest[:2] = rest[1::-1]
    kinds += [*["kitchen", *rest][: len(unnamed) - len(kinds) - 1], "bath"]
    named = list(rooms)
    for i, kind in zip(unnamed, kinds, strict=True):
        named[i] = replace(rooms[i], kind=kind)
    return named


def _doors(rng: np.random.Generator, rooms: Sequence[Room]) -> list[Opening]:
    """One way from the hall into each room: a wide one into the living room, doors into the others."""
    hall = rooms[0]
    doors = []
    for room in rooms[1:]:
        if room.x0 > hall.x1:
            start, end = hall.y0 + float(rng.uniform(0.1, 0.2)), hall.y1 - float(rng.uniform(0.1, 0.2))
            doors.append(Opening(kind="passage", axis=1, start=start, end=end, low=hall.x1, high=room.x0, z1=2.2))
            continue
        wide = room.kind == "living"
        width = float(rng.uniform(1.2, 1.5)) if wide else float(rng.uniform(0.84, 0.98))
        start = _door_position(rng, room.x0, room.x1 - width)
        low, high = (room.y1, hall.y0) if room.y1 < hall.y1 else (hall.y1, room.y0)
        kind = "passage" if wide else "door"
        doors.append(Opening(kind=kind, axis=0, start=start, end=start + width, low=low, high=high))
    return doors


def _door_position(rng: np.random.Generator, first: float, last: float) -> float:
    """Near one of the two corners, where an open leaf is out of the way, or now and then in between."""
    corner, between = float(rng.uniform(0.14, 0.22)), float(rng.uniform(0.3, 0.7))
    return float(rng.choice([first + corner, last - corner, first + between * (last - first)], p=[0.4, 0.4, 0.2]))


def _passages(rng: np.random.Generator, rooms: Sequence[Room]) -> list[Opening]:
    """Openings from the living room or the kitchen into neighbours, so that there is more than one way round."""
    found = []
    for a in rooms[1:]:
        for b in rooms[1:]:
            if abs(b.x0 - a.x1 - PARTITION_M) > 1e-9 or "bath" in (a.kind, b.kind):
                continue
            low, high = max(a.y0, b.y0), min(a.y1, b.y1)
            sociable = {"living", "kitchen"} == {a.kind, b.kind}
            if high - low < 2.4 or rng.random() > (0.85 if sociable else 0.3):
                continue
            width = float(rng.uniform(1.1, 1.5)) if sociable else 0.9
            start = low + float(rng.uniform(0.25, 0.75)) * (high - low - width)
            found.append(Opening(kind="passage", axis=1, start=start, end=start + width, low=a.x1, high=b.x0))
    return found


def _windows(rng: np.random.Generator, rooms: Sequence[Room]) -> list[Opening]:
    x1, y1 = max(room.x1 for room in rooms), max(room.y1 for room in rooms)
    found = []
    for room in rooms:
        sides = [(0, -1, room.y0, room.y0 == 0.0), (0, 1, room.y1, room.y1 == y1)]
        sides += [(1, -1, room.x0, room.kind == "hall"), (1, 1, room.x1, room.x1 == x1 and room.kind != "bath")]
        for axis, outside, face, exposed in sides:
            if exposed:
                low, high = (room.x0, room.x1) if axis == 0 else (room.y0, room.y1)
                found += _windows_in_wall(rng, room.kind, axis, outside, face, low, high)
    return found


def _windows_in_wall(
    rng: np.random.Generator, kind: str, axis: int, outside: int, face: float, low: float, high: float
) -> list[Opening]:
    length = high - low
    count = 2 if length > 3.9 else 1
    width = min(0.7 if kind in ("bath", "hall") else float(rng.uniform(1.1, 1.7)), length / count - 0.6)
    sill = {"living": float(rng.choice([0.35, 0.75])), "bath": 1.3, "kitchen": 1.1}.get(kind, 0.85)
    outer = (face - FACADE_M, face) if outside < 0 else (face, face + FACADE_M)
    found = []
    for i in range(1 if kind in ("bath", "hall") else count):
        centre = low + length * (i + 0.5) / count + float(rng.uniform(-0.1, 0.1))
        hole = Opening(
            kind="window",
            axis=axis,
            start=centre - width / 2,
            end=centre + width / 2,
            low=outer[0],
            high=outer[1],
            z0=sill,
            z1=2.15,
            outside=outside,
        )
        found.append(hole)
    return found


def _turned_and_moved(rng: np.random.Generator, plan: FloorPlan) -> FloorPlan:
    """Mirror the plan, exchange its axes, and shift it: no home stands like another in its world."""
    flip_x, flip_y, swap = (bool(value) for value in rng.random(3) < 0.5)
    shift = (round(float(rng.uniform(-9, 1)), 3), round(float(rng.uniform(-7, 1)), 3))

    def interval(a: float, b: float, axis: int) -> tuple[float, float]:
        low, high = (-b, -a) if (flip_x, flip_y)[axis] else (a, b)
        offset = shift[1 - axis if swap else axis]
        return low + offset, high + offset

    def room(r: Room) -> Room:
        (x0, x1), (y0, y1) = interval(r.x0, r.x1, 0), interval(r.y0, r.y1, 1)
        return replace(r, x0=y0, x1=y1, y0=x0, y1=x1) if swap else replace(r, x0=x0, x1=x1, y0=y0, y1=y1)

    def opening(o: Opening) -> Opening:
        (start, end), (low, high) = interval(o.start, o.end, o.axis), interval(o.low, o.high, 1 - o.axis)
        outside = -o.outside if (flip_x, flip_y)[1 - o.axis] else o.outside
        axis = 1 - o.axis if swap else o.axis
        return replace(o, axis=axis, start=start, end=end, low=low, high=high, outside=outside)

    return replace(plan, rooms=tuple(map(room, plan.rooms)), openings=tuple(map(opening, plan.openings)))
