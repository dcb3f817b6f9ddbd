import numpy as np
import pytest

from wsm_data.synth.home.furnishing import furnish_room, threshold


@pytest.fixture(scope="module")
def bedroom(two_rooms, style):
    return furnish_room(np.random.default_rng(0), two_rooms.rooms[1], two_rooms, style, 1.0)


def test_furniture_stays_inside_its_room(bedroom, two_rooms):
    room = two_rooms.rooms[1]
    for item in bedroom:
        points = item.surface.points_m
        assert points[..., 0].min() > room.x0 - 0.02
        assert points[..., 0].max() < room.x1 + 0.02
        assert points[..., 1].min() > room.y0 - 0.06  # the open leaf reaches into the doorway
        assert points[..., 1].max() < room.y1 + 0.02
        assert points[..., 2].max() <= two_rooms.ceiling_m + 1e-9


def test_a_bedroom_has_a_bed_a_door_and_light(bedroom):
    assert any(f[2] - f[0] > 0.9 and f[3] - f[1] > 0.9 for item in bedroom for f in item.footprints)
    assert sum(item.height_m == 2.0 and len(item.footprints) == 1 for item in bedroom) >= 1
    assert sum(len(item.lamps) for item in bedroom) >= 1


def test_fullness_zero_leaves_the_floor_free(two_rooms, style):
    bare = furnish_room(np.random.default_rng(0), two_rooms.rooms[1], two_rooms, style, 0.0)
    assert [item.height_m for item in bare if item.footprints] == [2.0]  # the door's leaf
    assert any(item.lamps for item in bare)


@pytest.mark.parametrize("kind", ["living", "kitchen", "bedroom", "study", "bath", "hall"])
def test_every_kind_of_room_is_furnished_the_same_for_the_same_seed(two_rooms, style, kind):
    from dataclasses import replace

    room = replace(two_rooms.rooms[1], kind=kind)
    plan = replace(two_rooms, rooms=(two_rooms.rooms[0], room))
    first, second = (furnish_room(np.random.default_rng(4), room, plan, style, 1.0) for _ in range(2))
    assert len(first) > 4
    assert [item.footprints for item in first] == [item.footprints for item in second]


def test_a_threshold_is_the_floor_within_the_wall(two_rooms):
    assert threshold(two_rooms.openings[0]) == (0.3, 2.0, 1.2, 2.12)
    assert threshold(two_rooms.openings[1]) == (4.0, 3.0, 4.2, 4.4)
