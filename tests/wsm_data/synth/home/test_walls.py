import numpy as np
import pytest

from wsm_data.synth.home.floor_plan import Room
from wsm_data.synth.home.style import choose_room_style
from wsm_data.synth.home.walls import SIDES, door_leaf, opening_surface, room_shell, wall_panel
from wsm_data.synth.render.surface import Material, Texture

ROOM = Room(kind="study", x0=1.0, y0=2.0, x1=4.0, y1=7.0)
INWARD = {"south": (0, 1, 0), "north": (0, -1, 0), "west": (1, 0, 0), "east": (-1, 0, 0)}


@pytest.mark.parametrize("side", SIDES)
def test_a_wall_panel_lies_on_its_wall_and_faces_into_the_room(side):
    wall = wall_panel(ROOM, side, 2.5, 3.5, 0.5, 2.0, Material())
    assert wall.normals[0, 0].tolist() == list(INWARD[side])
    across = 1 if side in ("south", "north") else 0
    face = {"south": 2.0, "north": 7.0, "west": 1.0, "east": 4.0}[side]
    assert (wall.points_m[0, :, across] == face).all()
    assert sorted(set(wall.points_m[0, :, 1 - across])) == [2.5, 3.5]


def area(surface, chosen) -> float:
    edges = surface.points_m[:, 1:] - surface.points_m[:, :1]
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)[chosen].sum())


def test_walls_have_holes_where_doors_and_windows_are(two_rooms, style):
    bedroom = two_rooms.rooms[1]
    look = choose_room_style(np.random.default_rng(0), bedroom, style, 0)
    shell = room_shell(bedroom, two_rooms, look, style, "west")
    door, window = two_rooms.openings
    for axis, face, inward, hole in ((1, bedroom.y0, 1, door), (0, bedroom.x1, -1, window)):
        on_wall = (shell.points_m[..., axis] == face).all(axis=1) & (shell.normals[:, 0, axis] == inward)
        length = 4.0 if axis == 1 else 3.0
        assert area(shell, on_wall) == pytest.approx(length * 2.6 - (hole.end - hole.start) * (hole.z1 - hole.z0))
        a, d = shell.points_m[on_wall, 0], shell.points_m[on_wall, 1:].max(axis=1)
        middle = (hole.start + hole.end) / 2, (hole.z0 + hole.z1) / 2
        low, high = np.minimum(a, shell.points_m[on_wall].min(axis=1)), np.maximum(a, d)
        covers = (low[:, 1 - axis] < middle[0]) & (middle[0] < high[:, 1 - axis])
        covers &= (low[:, 2] < middle[1]) & (middle[1] < high[:, 2])
        assert not covers.any()


def test_the_lining_of_a_door_faces_into_the_hole(two_rooms, style):
    door = two_rooms.openings[0]
    filled = opening_surface(door, two_rooms.rooms, style, Material(), Texture.VIEW_TOWN)
    centre = np.array([(door.start + door.end) / 2, (door.low + door.high) / 2, 1.0])
    lining = slice(0, 4)  # both sides, the head, the threshold
    middle = filled.points_m[lining, 1:].mean(axis=1)
    assert ((centre - middle) * filled.normals[lining, 0]).sum(axis=1).min() > 0


def test_the_view_from_a_window_shines_and_faces_into_the_room(two_rooms, style):
    window = two_rooms.openings[1]
    filled = opening_surface(window, two_rooms.rooms, style, Material(), Texture.VIEW_GARDEN)
    view = filled.texture == Texture.VIEW_GARDEN
    assert filled.emission[view].tolist() == [1.0]
    assert filled.normals[view, 0].tolist() == [[-1, 0, 0]]


def test_a_leaf_stands_open_into_the_room_beside_the_nearer_wall(two_rooms, style):
    door, bedroom = two_rooms.openings[0], two_rooms.rooms[1]
    leaf, (x, y, heading) = door_leaf(door, bedroom, style, style.white, np.pi / 2)
    assert (x, y) == pytest.approx((0.305, 2.12))  # hinged at the end near x = 0
    assert heading == pytest.approx(np.pi / 2)
    points = leaf.points_m.reshape(-1, 3)
    assert points[:, 1].min() > 2.1
    assert points[:, 1].max() == pytest.approx(2.12 + 0.88, abs=0.01)
