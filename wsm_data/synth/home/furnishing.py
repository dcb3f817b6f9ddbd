"""Which furniture goes into which room."""

from collections.abc import Callable

import numpy as np

from wsm_data.synth.home.floor_plan import FloorPlan, Opening, Room, side_of
from wsm_data.synth.home.furniture import bath, bedding, decor, kitchen, seating, storage, tables
from wsm_data.synth.home.furniture.piece import Piece, Rectangle, group, move
from wsm_data.synth.home.placing import RoomLayout, at_wall, hang, place_at_wall, place_in_middle, start_layout
from wsm_data.synth.home.style import Style
from wsm_data.synth.home.walls import door_leaf
from wsm_data.synth.render.surface import Material

_OPPOSITE = {"south": "north", "north": "south", "west": "east", "east": "west"}


def furnish_room(rng: np.random.Generator, room: Room, plan: FloorPlan, style: Style, fullness: float) -> list[Piece]:
    """Furniture of one room, in world coordinates.

    Args:
        rng: source of randomness.
        room: the room.
        plan: the storey it is part of.
        style: materials of the home.
        fullness: 1 for as much as looks natural, less to leave more floor free, 0 for doors, lamps and pictures alone.
    """
    layout = start_layout(room, plan)
    _hang_doors(rng, layout, plan, style)
    if fullness > 0:
        _FURNISH[room.kind](rng, layout, style, fullness)
    _finish(rng, layout, plan, style, fullness)
    return layout.pieces


def _hang_doors(rng: np.random.Generator, layout: RoomLayout, plan: FloorPlan, style: Style) -> None:
    """Leaves stand open in the room that is not the hall; between two rooms, in the second one."""
    for openings in layout.holes.values():
        for opening in openings:
            if opening.kind == "door" and layout.room is _room_of_leaf(opening, plan):
                colour = style.white if style.scheme.wood[0] > 0.65 else style.wood
                leaf, (x, y, heading) = door_leaf(opening, layout.room, style, colour, float(rng.uniform(1.45, 1.62)))
                width = opening.end - opening.start
                tip = (x + width * float(np.cos(heading)), y + width * float(np.sin(heading)))
                taken = (min(x, tip[0]) - 0.06, min(y, tip[1]) - 0.06, max(x, tip[0]) + 0.06, max(y, tip[1]) + 0.06)
                layout.pieces.append(Piece(surface=leaf, footprints=(taken,), height_m=2.0))
                layout.taken.append(taken)


def _room_of_leaf(opening: Opening, plan: FloorPlan) -> Room:
    beside = [room for room in plan.rooms if side_of(opening, room) is not None]
    return next((room for room in reversed(beside) if room.kind != "hall"), beside[0])


def _living(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    room = layout.room
    side = None
    for width in (2.3, 1.9, 1.6):
        side = side or place_at_wall(rng, layout, _sofa_corner(rng, style, width), front_m=0.5)
    if side is not None:
        place_at_wall(rng, layout, storage.television(rng, style), sides=(_OPPOSITE[side],), front_m=0.4)
    wide = float(rng.uniform(0.9, 1.6))
    place_at_wall(rng, layout, storage.bookshelf(rng, style, wide, float(rng.uniform(1.7, 2.1))))
    place_at_wall(rng, layout, seating.armchair(style, style.cloth[1]), corner=rng.random() < 0.5)
    if room.area_m2 > 26 * fullness:
        dining = tables.dining_set(rng, style, int(rng.choice([4, 6])))
        yaws = (0.0, np.pi / 2)
        _ = place_in_middle(rng, layout, dining, 0.62, yaws) or place_in_middle(
            rng, layout, tables.round_dining_set(rng, style), 0.6, yaws
        )
    place_at_wall(rng, layout, storage.chest(rng, style, 1.4, 0.8))
    if rng.random() < fullness:
        place_at_wall(rng, layout, storage.bookshelf(rng, style, 0.8, 1.2))
    _in_corners(rng, layout, [decor.floor_lamp(style), decor.plant(rng, style, float(rng.uniform(0.8, 1.4)))])
    _in_corners(rng, layout, [decor.plant(rng, style, 0.7), decor.basket(rng)])


def _sofa_corner(rng: np.random.Generator, style: Style, width_m: float) -> Piece:
    """A sofa with a table before it on a rug."""
    table = tables.coffee_table(rng, style)
    items = [
        seating.sofa(rng, style, width_m, style.cloth[0]),
        move(table, (float(rng.uniform(-0.15, 0.15)), 0.92 + 0.6), 0.0),
        move(decor.rug(rng, (width_m + 0.3, 1.7)), (0.0, 1.62), 0.0),
    ]
    return group(items)


def _kitchen(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    for length, high in ((3.4, True), (2.9, True), (2.5, True), (3.0, False), (2.4, False), (1.8, False)):
        if place_at_wall(rng, layout, kitchen.kitchen_run(rng, style, length, high), front_m=0.8) is not None:
            break
    yaws = (0.0, np.pi / 2)
    big = layout.room.area_m2 > 13 * fullness
    sets: list[Piece] = [tables.dining_set(rng, style, 4), tables.round_dining_set(rng, style)]
    if big and rng.random() < 0.3:
        sets.insert(0, kitchen.island(rng, style))
    for item in sets:
        if place_in_middle(rng, layout, item, 0.5, yaws):
            break
    place_at_wall(rng, layout, storage.chest(rng, style, 1.2, 0.85))
    _in_corners(rng, layout, [kitchen.waste_bin(), decor.plant(rng, style, 0.8)])


def _bedroom(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    side = None
    for width, count in ((1.6, 2), (1.4, 2), (1.4, 1), (0.9, 1)):
        if side is None:
            side = place_at_wall(rng, layout, bedding.bed_set(rng, style, width, count), front_m=0.55)
    place_at_wall(rng, layout, storage.wardrobe(rng, style, float(rng.choice([1.0, 1.5]))))
    place_at_wall(rng, layout, storage.chest(rng, style, float(rng.uniform(0.8, 1.1)), 0.85))
    if rng.random() < 0.5 * fullness:
        place_at_wall(rng, layout, tables.desk_set(rng, style), front_m=0.1)
    if rng.random() < 0.6 * fullness:
        place_at_wall(rng, layout, seating.armchair(style, style.cloth[2]), corner=True)
    rug = decor.rug(rng, (1.3, 0.8))
    place_flat(layout, rug)
    _in_corners(rng, layout, [decor.plant(rng, style, float(rng.uniform(0.6, 1.1))), decor.basket(rng)])


def _study(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    place_at_wall(rng, layout, tables.desk_set(rng, style), front_m=0.3)
    for _ in range(2 if fullness > 0.7 else 1):
        wide = float(rng.uniform(0.8, 1.4))
        place_at_wall(rng, layout, storage.bookshelf(rng, style, wide, float(rng.uniform(1.8, 2.2))))
    if rng.random() < 0.5:
        place_at_wall(rng, layout, seating.sofa(rng, style, 1.6, style.cloth[2]))
    else:
        place_at_wall(rng, layout, seating.armchair(style, style.cloth[0]), corner=True)
    place_at_wall(rng, layout, storage.chest(rng, style, 0.9, 0.7))
    place_flat(layout, decor.rug(rng, (1.7, 1.2)))
    _in_corners(rng, layout, [decor.floor_lamp(style), decor.plant(rng, style, float(rng.uniform(0.7, 1.3)))])


def _bath(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    tub = bath.bathtub(style)
    if fullness < 0.7 or place_at_wall(rng, layout, tub, corner=True) is None:
        place_at_wall(rng, layout, bath.shower(style), corner=True)
    place_at_wall(rng, layout, bath.basin(rng, style))
    place_at_wall(rng, layout, bath.toilet())
    place_at_wall(rng, layout, bath.towel_rail(style), front_m=0.3)
    place_flat(layout, decor.rug(rng, (0.9, 0.6)))
    _in_corners(rng, layout, [decor.basket(rng), decor.plant(rng, style, 0.6)])


def _hall(rng: np.random.Generator, layout: RoomLayout, style: Style, fullness: float) -> None:
    for item in (storage.coat_rack(rng, style), tables.console(rng, style)):
        if rng.random() < 0.8 * fullness:
            place_at_wall(rng, layout, item, front_m=0.85)
    room = layout.room
    along = room.x1 - room.x0 > room.y1 - room.y0
    length, width = (max(room.x1 - room.x0, room.y1 - room.y0), min(room.x1 - room.x0, room.y1 - room.y0))
    runner = decor.rug(rng, (0.55 * length, 0.5 * width))
    centre = ((room.x0 + room.x1) / 2, (room.y0 + room.y1) / 2)
    layout.pieces.append(move(runner, centre, 0.0 if along else np.pi / 2))


_Furnisher = Callable[[np.random.Generator, RoomLayout, Style, float], None]
_FURNISH: dict[str, _Furnisher] = {
    "living": _living,
    "kitchen": _kitchen,
    "bedroom": _bedroom,
    "study": _study,
    "bath": _bath,
    "hall": _hall,
}


def place_flat(layout: RoomLayout, item: Piece) -> None:
    """Lay a rug in the middle of the room; furniture may stand on it."""
    room = layout.room
    yaw = 0.0 if room.x1 - room.x0 > room.y1 - room.y0 else np.pi / 2
    layout.pieces.append(move(item, ((room.x0 + room.x1) / 2, (room.y0 + room.y1) / 2), yaw))


def _in_corners(rng: np.random.Generator, layout: RoomLayout, items: list[Piece]) -> None:
    for item in items:
        place_at_wall(rng, layout, item, corner=True, front_m=0.05)


def _finish(rng: np.random.Generator, layout: RoomLayout, plan: FloorPlan, style: Style, fullness: float) -> None:
    """Curtains, pictures and the ceiling's lamps."""
    room = layout.room
    cloth: Material = style.accents[int(rng.integers(5))]
    for side, openings in layout.holes.items():
        for o in openings:
            if o.kind == "window" and room.kind in ("living", "bedroom", "study"):
                drapes = decor.curtains(style, o.end - o.start, max(0.2, o.z0 - 0.3), 2.26, cloth)
                layout.pieces.append(at_wall(drapes, room, side, (o.start + o.end) / 2, gap_m=0.0))
                layout.covered.append((side, o.start - 0.3, o.end + 0.3, 9.0))
    for _ in range({"living": 5, "hall": 4, "bath": 0}.get(room.kind, 3)):
        width = float(rng.uniform(0.45, 0.95))
        size = (width, width * float(rng.choice([0.75, 1.0, 1.3])))
        if size[1] > 0.9:
            size = (size[0] * 0.9 / size[1], 0.9)
        hang(rng, layout, decor.picture(rng, style, size, 1.5), size[0], 1.5 - size[1] / 2)
    if room.kind == "hall" and fullness > 0.5:
        hang(rng, layout, decor.wall_mirror(style, (0.6, 1.1), 1.4), 0.6, 0.85)
    layout.pieces.extend(_ceiling_lamps(rng, room, plan.ceiling_m, style))


def _ceiling_lamps(rng: np.random.Generator, room: Room, ceiling_m: float, style: Style) -> list[Piece]:
    """One lamp every three metres or so."""
    columns = max(1, round((room.x1 - room.x0) / 3.4))
    rows = max(1, round((room.y1 - room.y0) / 3.4))
    drop = 0.0 if room.kind in ("hall", "bath") or rng.random() < 0.4 else float(rng.uniform(0.35, 0.6))
    strength = float(rng.uniform(1.3, 1.9)) * (0.75 if room.kind == "hall" else 1.0)
    lamps = []
    for i in range(columns):
        for j in range(rows):
            x = room.x0 + (room.x1 - room.x0) * (i + 0.5) / columns
            y = room.y0 + (room.y1 - room.y0) * (j + 0.5) / rows
            lamps.append(move(decor.ceiling_lamp(rng, style, ceiling_m, drop, strength), (x, y), 0.0))
    return lamps


def threshold(opening: Opening) -> Rectangle:
    """The floor inside a doorway."""
    if opening.axis == 0:
        return opening.start, opening.low, opening.end, opening.high
    return opening.low, opening.start, opening.high, opening.end
