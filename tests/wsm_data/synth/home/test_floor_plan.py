import itertools

import numpy as np
import pytest

from wsm_data.synth.home.floor_plan import MIN_ROOM_WIDTH_M, PARTITION_M, make_floor_plan, side_of

SEEDS = range(40)


@pytest.fixture(scope="module")
def plans():
    return [make_floor_plan(np.random.default_rng(seed)) for seed in SEEDS]


def test_every_home_has_rooms_for_living_cooking_sleeping_and_bathing_around_a_hall(plans):
    for plan in plans:
        kinds = [room.kind for room in plan.rooms]
        assert kinds[0] == "hall"
        assert kinds.count("bath") == kinds.count("kitchen") == kinds.count("living") == kinds.count("hall") == 1
        assert 5 <= len(kinds) <= 9
        assert {"bedroom", "study"} & set(kinds)


def test_rooms_stand_a_partition_apart(plans):
    for plan in plans:
        for a, b in itertools.combinations(plan.rooms, 2):
            apart = max(a.x0 - b.x1, b.x0 - a.x1, a.y0 - b.y1, b.y0 - a.y1)
            assert apart > PARTITION_M - 1e-9


def test_only_the_bath_and_the_hall_are_narrow(plans):
    for plan in plans:
        for room in plan.rooms:
            if room.kind not in ("bath", "hall"):
                assert min(room.x1 - room.x0, room.y1 - room.y0) > MIN_ROOM_WIDTH_M - 1e-9


def test_every_room_can_be_reached_from_the_hall(plans):
    for plan in plans:
        reached, found = {0}, True
        beside = [
            {i for i, room in enumerate(plan.rooms) if side_of(opening, room) is not None}
            for opening in plan.openings
            if opening.kind != "window"
        ]
        while found:
            found = [pair for pair in beside if pair & reached and not pair <= reached]
            reached = reached.union(*found)
        assert len(reached) == len(plan.rooms)
        assert all(len(pair) == 2 for pair in beside)


def test_doors_let_a_robot_of_half_a_metre_through(plans):
    widths = [o.end - o.start for plan in plans for o in plan.openings if o.kind != "window"]
    assert min(widths) > 0.8
    assert {o.kind for plan in plans for o in plan.openings} == {"door", "passage", "window"}


def test_windows_are_in_one_room_each_and_above_their_sill(plans):
    for plan in plans:
        for opening in plan.openings:
            if opening.kind == "window":
                assert sum(side_of(opening, room) is not None for room in plan.rooms) == 1
                assert 0 < opening.z0 < opening.z1 < plan.ceiling_m
                assert opening.outside in (-1, 1)


def test_homes_differ_and_do_not_stand_around_the_origin(plans):
    assert len({len(plan.rooms) for plan in plans}) > 1
    centres = np.array([((p.rooms[0].x0 + p.rooms[0].x1) / 2, (p.rooms[0].y0 + p.rooms[0].y1) / 2) for p in plans])
    assert (centres.min(axis=0) < -1).all()
    assert (centres.max(axis=0) > 1).all()
    assert {o.axis for p in plans for o in p.openings if o.kind == "door"} == {0, 1}


def test_a_wall_knows_the_opening_in_it(two_rooms):
    door, window = two_rooms.openings
    hall, bedroom = two_rooms.rooms
    assert (side_of(door, hall), side_of(door, bedroom)) == ("north", "south")
    assert (side_of(window, hall), side_of(window, bedroom)) == (None, "east")
