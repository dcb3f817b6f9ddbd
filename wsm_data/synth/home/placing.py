"""Finding room for furniture: against walls, in corners, in the middle, without blocking doors."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from wsm_data.synth.home.floor_plan import FloorPlan, Opening, Room, side_of
from wsm_data.synth.home.furniture.piece import Piece, Rectangle, move

DOORWAY_M = 0.95
"""What is kept free before a door, m."""

FRONT_M = 0.62
"""What is kept free before furniture, m: a robot of radius 0.25 m passes."""

_YAW = {"south": 0.0, "north": np.pi, "west": -np.pi / 2, "east": np.pi / 2}
_TRIES = 40


@dataclass(frozen=True, kw_only=True)
class RoomLayout:
    """A room being furnished; the lists grow as pieces are placed.

    Attributes:
        room: the room.
        holes: openings in its walls, by side.
        pieces: what was placed, in world coordinates.
        taken: floor that furniture stands on.
        free: floor that must stay free.
        covered: stretches of wall behind furniture: side, start, end, height.
    """

    room: Room
    holes: dict[str, list[Opening]]
    pieces: list[Piece] = field(default_factory=list)
    taken: list[Rectangle] = field(default_factory=list)
    free: list[Rectangle] = field(default_factory=list)
    covered: list[tuple[str, float, float, float]] = field(default_factory=list)


def start_layout(room: Room, plan: FloorPlan) -> RoomLayout:
    """An empty room whose doorways stay free."""
    holes: dict[str, list[Opening]] = {side: [] for side in _YAW}
    layout = RoomLayout(room=room, holes=holes)
    for opening in plan.openings:
        side = side_of(opening, room)
        if side is None:
            continue
        holes[side].append(opening)
        if opening.kind != "window":
            a, b = opening.start - 0.1, opening.end + 0.1
            faces = {"south": room.y0, "north": room.y1, "west": room.x0, "east": room.x1}
            face, inward = faces[side], DOORWAY_M if side in ("south", "west") else -DOORWAY_M
            low, high = sorted((face, face + inward))
            layout.free.append((a, low, b, high) if side in ("south", "north") else (low, a, high, b))
    return layout


def wall_stretch(room: Room, side: str) -> tuple[float, float]:
    """Where a wall begins and ends along its axis."""
    return (room.x0, room.x1) if side in ("south", "north") else (room.y0, room.y1)


def at_wall(item: Piece, room: Room, side: str, along: float, gap_m: float = 0.02, z_m: float = 0.0) -> Piece:
    """The piece with its back to a wall, its middle `along` that wall."""
    positions = {
        "south": (along, room.y0 + gap_m),
        "north": (along, room.y1 - gap_m),
        "west": (room.x0 + gap_m, along),
        "east": (room.x1 - gap_m, along),
    }
    return move(item, positions[side], _YAW[side], z_m)


def overlap(a: Rectangle, b: Rectangle) -> bool:
    """Whether two rectangles share floor."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def grown(r: Rectangle, by_m: float) -> Rectangle:
    """The rectangle with all sides moved out."""
    return r[0] - by_m, r[1] - by_m, r[2] + by_m, r[3] + by_m


def fits(layout: RoomLayout, item: Piece, gap_m: float) -> bool:
    """Whether the piece stands inside the room, on free floor, `gap_m` from other furniture."""
    room = layout.room
    for r in item.footprints:
        inside = room.x0 - 1e-6 <= r[0] and r[2] <= room.x1 + 1e-6 and room.y0 - 1e-6 <= r[1] and r[3] <= room.y1 + 1e-6
        if not inside or any(overlap(r, other) for other in layout.free):
            return False
        if any(overlap(grown(r, gap_m), other) for other in layout.taken):
            return False
    return True


def place_at_wall(
    rng: np.random.Generator,
    layout: RoomLayout,
    item: Piece,
    sides: Sequence[str] = (),
    corner: bool = False,
    gap_m: float = 0.03,
    front_m: float = FRONT_M,
) -> str | None:
    """Put a piece against some wall where it fits; returns the side, or None where it fits nowhere."""
    half = max(r[2] for r in item.footprints), -min(r[0] for r in item.footprints)
    for _ in range(_TRIES):
        side = str(rng.choice(list(sides) or list(_YAW)))
        low, high = wall_stretch(layout.room, side)
        low, high = low + max(half) + 0.03, high - max(half) - 0.03
        if low > high:
            continue
        along = float(rng.choice([low, high])) if corner else float(rng.uniform(low, high))
        candidate = at_wall(item, layout.room, side, along)
        if _covers_window(layout, side, along - max(half), along + max(half), item.height_m):
            continue
        front = _front(candidate, side, front_m)
        if fits(layout, candidate, gap_m) and not any(overlap(front, other) for other in layout.taken):
            _take(layout, candidate)
            layout.free.append(front)
            layout.covered.append((side, along - half[1], along + half[0], item.height_m))
            return side
    return None


def place_in_middle(
    rng: np.random.Generator, layout: RoomLayout, item: Piece, gap_m: float, yaws: Sequence[float]
) -> bool:
    """Put a piece somewhere away from the walls; returns whether it fitted."""
    room = layout.room
    for _ in range(_TRIES):
        position = (float(rng.uniform(room.x0, room.x1)), float(rng.uniform(room.y0, room.y1)))
        candidate = move(item, position, float(rng.choice(list(yaws))))
        if fits(layout, candidate, gap_m) and all(_off_walls(layout.room, r, gap_m) for r in candidate.footprints):
            _take(layout, candidate)
            return True
    return False


def hang(rng: np.random.Generator, layout: RoomLayout, item: Piece, width_m: float, low_m: float) -> str | None:
    """Put a flat piece on a free stretch of wall, above what stands there; returns the side or None."""
    for _ in range(_TRIES):
        side = str(rng.choice(list(_YAW)))
        low, high = wall_stretch(layout.room, side)
        if high - low < width_m + 0.4:
            continue
        along = float(rng.uniform(low + width_m / 2 + 0.2, high - width_m / 2 - 0.2))
        a, b = along - width_m / 2 - 0.12, along + width_m / 2 + 0.12
        blocked = any(o.start < b and a < o.end for o in layout.holes[side])
        blocked |= any(s == side and s0 < b and a < s1 and h > low_m for s, s0, s1, h in layout.covered)
        if not blocked:
            layout.pieces.append(at_wall(item, layout.room, side, along, gap_m=0.0))
            layout.covered.append((side, a, b, 9.0))
            return side
    return None


def _covers_window(layout: RoomLayout, side: str, a: float, b: float, height_m: float) -> bool:
    return any(o.start < b and a < o.end and height_m > o.z0 + 0.05 for o in layout.holes[side])


def _off_walls(room: Room, r: Rectangle, gap_m: float) -> bool:
    return r[0] - gap_m > room.x0 and r[2] + gap_m < room.x1 and r[1] - gap_m > room.y0 and r[3] + gap_m < room.y1


def _front(item: Piece, side: str, depth_m: float) -> Rectangle:
    """The strip of floor before a piece."""
    r = np.array(item.footprints)
    x0, y0, x1, y1 = float(r[:, 0].min()), float(r[:, 1].min()), float(r[:, 2].max()), float(r[:, 3].max())
    strips = {
        "south": (x0, y1, x1, y1 + depth_m),
        "north": (x0, y0 - depth_m, x1, y0),
        "west": (x1, y0, x1 + depth_m, y1),
        "east": (x0 - depth_m, y0, x0, y1),
    }
    return strips[side]


def _take(layout: RoomLayout, item: Piece) -> None:
    layout.pieces.append(item)
    layout.taken.extend(item.footprints)
