import itertools

import numpy as np
import pytest

from wsm_data.synth.home.furniture.piece import Piece, piece
from wsm_data.synth.home.placing import (
    DOORWAY_M,
    at_wall,
    fits,
    hang,
    overlap,
    place_at_wall,
    place_in_middle,
    start_layout,
)
from wsm_data.synth.home.solids import block
from wsm_data.synth.render.surface import Material


def crate(width: float = 0.8, depth: float = 0.5, height: float = 0.6) -> Piece:
    return piece([block((0, depth / 2), 0, (width, depth, height), Material())], width, depth, height)


@pytest.fixture
def layout(two_rooms):
    return start_layout(two_rooms.rooms[1], two_rooms)


def test_the_floor_before_a_door_stays_free(layout):
    assert layout.free == [(pytest.approx(0.2), 2.12, pytest.approx(1.3), pytest.approx(2.12 + DOORWAY_M))]
    assert not fits(layout, at_wall(crate(), layout.room, "south", 0.9), 0.0)
    assert fits(layout, at_wall(crate(), layout.room, "south", 2.5), 0.0)


@pytest.mark.parametrize(
    ("side", "footprint"),
    [
        ("south", (1.6, 2.12, 2.4, 2.62)),
        ("north", (1.6, 4.62, 2.4, 5.12)),
        ("west", (0.0, 1.6, 0.5, 2.4)),
        ("east", (3.5, 1.6, 4.0, 2.4)),
    ],
)
def test_furniture_stands_with_its_back_to_the_wall(layout, side, footprint):
    assert at_wall(crate(), layout.room, side, 2.0, gap_m=0.0).footprints[0] == pytest.approx(footprint)


def test_placed_furniture_neither_overlaps_nor_blocks(layout):
    rng = np.random.default_rng(0)
    for _ in range(6):
        place_at_wall(rng, layout, crate())
    assert len(layout.taken) >= 3
    assert not any(overlap(a, b) for a, b in itertools.combinations(layout.taken, 2))
    assert not any(overlap(a, b) for a in layout.taken for b in layout.free)


def test_high_furniture_does_not_stand_before_a_window(layout):
    rng = np.random.default_rng(0)
    assert place_at_wall(rng, layout, crate(width=1.2, height=2.0), sides=("east",)) is None
    assert place_at_wall(rng, layout, crate(width=1.2, height=0.6), sides=("east",)) == "east"


def test_what_stands_in_the_middle_keeps_off_the_walls(layout):
    assert place_in_middle(np.random.default_rng(0), layout, crate(), 0.6, (0.0,))
    x0, y0, x1, y1 = layout.taken[0]
    room = layout.room
    assert min(x0 - room.x0, y0 - room.y0, room.x1 - x1, room.y1 - y1) > 0.6
    assert not place_in_middle(np.random.default_rng(0), layout, crate(3.5, 2.5), 0.6, (0.0,))


def test_pictures_hang_on_bare_wall_and_each_on_its_own(layout):
    rng = np.random.default_rng(1)
    sides = [hang(rng, layout, crate(0.6, 0.02, 0.6), 0.6, 1.2) for _ in range(12)]
    stretches = [(side, a, b) for side, a, b, _ in layout.covered]
    assert None in sides  # the walls are full at last
    for (side, a, b), (other, c, d) in itertools.combinations(stretches, 2):
        assert side != other or b <= c or d <= a
    for side, a, b in stretches:
        assert not any(o.start < b and a < o.end for o in layout.holes[side])
