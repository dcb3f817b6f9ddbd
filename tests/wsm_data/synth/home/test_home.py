import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from wsm_data.synth.drive.occupancy import clearance
from wsm_data.synth.home import home as home_module
from wsm_data.synth.home.furnishing import furnish_room
from wsm_data.synth.home.home import home_glb, home_trimesh, make_home, room_at
from wsm_data.synth.render.surface import Texture


def test_the_same_seed_gives_the_same_home_to_the_bit_and_another_one_another(home):
    again, other = make_home(0, 0), make_home(0, 1)
    for name in ("points_m", "uv_texel", "light", "texels", "texture"):
        assert (getattr(again.mesh, name) == getattr(home.mesh, name)).all()
    assert other.floor_plan != home.floor_plan


def test_a_home_has_ten_to_thirty_five_thousand_triangles(home):
    assert 10_000 < len(home.mesh.points_m) < 35_000


def test_floors_cover_all_rooms_at_height_zero(home):
    floor = home.surface.points_m[home.floor_patch]
    assert (floor[..., 2] == 0).all()
    area = np.linalg.norm(np.cross(floor[:, 1] - floor[:, 0], floor[:, 2] - floor[:, 0]), axis=1).sum()
    rooms = sum(room.area_m2 for room in home.floor_plan.rooms)
    assert rooms < area < 1.05 * rooms  # thresholds are the rest


def test_every_room_can_be_driven_into_by_the_tallest_robot(home, columns, small):
    room = clearance(columns, 1.5, small)
    labels, _ = ndimage.label(room.distance_m > 0.3)
    largest = np.bincount(labels.ravel())[1:].argmax() + 1
    centres = room.centres(np.flatnonzero(labels.ravel() == largest))
    names = {id(room_at(home.floor_plan, (x, y))) for x, y in centres.tolist()}
    assert {id(room) for room in home.floor_plan.rooms} <= names


def test_low_robots_have_more_room_than_high_ones(columns, small):
    free = [(clearance(columns, height, small).distance_m > 0.25).sum() for height in (0.25, 0.6, 0.9, 1.5)]
    assert free == sorted(free, reverse=True)
    assert free[0] > 1.05 * free[-1]  # some go under tables


def test_light_differs_across_a_home_and_is_neither_black_nor_burnt_out(home):
    red = home.mesh.light & 0xFFFF
    assert np.quantile(red, 0.05) < 0.6 * np.quantile(red, 0.95)
    assert np.median(red) > 100
    assert (red == 1023).mean() < 0.001


def test_trimesh_sees_the_same_triangles_in_colour(home):
    mesh = home_trimesh(home)
    assert len(mesh.faces) == len(home.mesh.points_m)
    assert -0.01 < mesh.bounds[0, 2] <= 0.0  # the rims of slanting legs dip into the floor
    assert mesh.bounds[1, 2] == pytest.approx(home.floor_plan.ceiling_m)
    assert len(np.unique(mesh.visual.face_colors, axis=0)) > 20


def test_a_viewer_gets_the_home_upright_and_in_world_coordinates_below_one_turned_node(home):
    data = home_glb(home)
    assert data == home_glb(home)
    scene = trimesh.load_scene(io.BytesIO(data), file_type="glb")
    (model,) = scene.geometry.values()
    triangles = model.vertices[model.faces]
    assert np.abs(triangles - home.mesh.points_m).max() < 1e-5  # float32 of some metres
    assert scene.bounds[1, 1] == pytest.approx(home.floor_plan.ceiling_m)  # glTF's up is y
    assert len(np.unique(model.visual.vertex_colors, axis=0)) > 20


@pytest.mark.parametrize(("ground_clearance_m", "emptied"), [(0.15, True), (0.25, False)])
def test_a_room_is_furnished_again_only_where_its_way_is_blocked_by_what_is_not_driven_over(
    ground_clearance_m, emptied, monkeypatch
):
    asked = set()

    def with_a_platform(rng, room, plan, style, fullness):
        """The first piece of a fully furnished room covers all of it, 0.2 m high."""
        asked.add(fullness)
        pieces = furnish_room(rng, room, plan, style, fullness)
        whole = ((room.x0, room.y0, room.x1, room.y1),)
        return [replace(pieces[0], height_m=0.2, footprints=whole), *pieces[1:]] if fullness == 1.0 else pieces

    monkeypatch.setattr(home_module, "furnish_room", with_a_platform)
    make_home(0, 0, ground_clearance_m)
    assert (0.8 in asked) == emptied


def test_pictures_rugs_and_windows_are_there(home):
    used = {Texture(value).name.split("_")[0] for value in set(home.surface.texture.tolist())}
    assert {"PICTURE", "RUG", "VIEW", "BOOK", "LEAF", "WOOD"} <= used


def test_a_point_is_in_its_room_or_in_none(home):
    room = home.floor_plan.rooms[2]
    assert room_at(home.floor_plan, ((room.x0 + room.x1) / 2, room.y0 + 0.1)) is room
    assert room_at(home.floor_plan, (1e3, 0.0)) is None
