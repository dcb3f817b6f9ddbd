import numpy as np
import pytest

from wsm_data.synth.home.furniture import decor
from wsm_data.synth.render.surface import Texture


def test_what_stands_on_the_floor_stands_on_its_footprint(style, stands_on_its_footprint):
    rng = np.random.default_rng(0)
    for item in (decor.plant(rng, style, 1.2), decor.floor_lamp(style), decor.basket(rng)):
        stands_on_its_footprint(item)


def test_lamps_light_up_where_their_shades_are(style):
    rng = np.random.default_rng(0)
    for item in (decor.table_lamp(style), decor.floor_lamp(style), decor.ceiling_lamp(rng, style, 2.6, 0.5, 1.0)):
        shining = item.surface.emission > 0.9
        z = item.surface.points_m[shining, :, 2]
        assert z.min() - 0.2 < item.lamps[0].xyz_m[2] < z.max()


def test_a_pendant_hangs_from_the_ceiling_and_a_dish_lies_against_it(style):
    for drop in (0.0, 0.5):
        z = decor.ceiling_lamp(np.random.default_rng(0), style, 2.6, drop, 1.0).surface.points_m[..., 2]
        assert z.max() == pytest.approx(2.6, abs=0.01)
        assert z.min() == pytest.approx(2.6 - 0.1 if drop == 0 else 2.6 - drop - 0.165, abs=0.01)


def test_rugs_are_flat_enough_to_drive_over_and_take_no_floor(style):
    rug = decor.rug(np.random.default_rng(0), (2.0, 1.5))
    assert rug.footprints == ()
    assert rug.surface.points_m[..., 2].max() < 0.01


def test_leaves_and_curtains_are_seen_from_both_sides(style):
    rng = np.random.default_rng(0)
    plant = decor.plant(rng, style, 1.0).surface
    assert plant.two_sided[plant.texture == Texture.LEAF].all()
    cloth = decor.curtains(style, 1.4, 0.3, 2.2, style.accents[0]).surface
    assert cloth.two_sided[cloth.texture == Texture.FABRIC].any()


def test_pictures_and_mirrors_face_into_the_room_at_their_height(style):
    rng = np.random.default_rng(0)
    for item in (decor.picture(rng, style, (0.8, 0.6), 1.5), decor.wall_mirror(style, (0.6, 0.8), 1.4)):
        last = item.surface.points_m[-1]
        assert item.surface.normals[-1, 0].tolist() == [0, 1, 0]
        assert 1.0 < last[:, 2].mean() < 1.6
        assert item.surface.points_m[..., 1].min() == pytest.approx(0.0, abs=1e-9)


def test_standing_books_stay_within_their_shelf(style):
    row = decor.books_standing(np.random.default_rng(0), style, 0.8, 0.3, 0.24).points_m
    assert row[..., 0].min() >= 0
    assert row[..., 0].max() <= 0.8
    assert row[..., 1].max() == pytest.approx(0.0, abs=1e-12)
    assert row[..., 2].max() < 0.3


def test_small_things_rest_on_their_table(style):
    rng = np.random.default_rng(0)
    for item in (
        decor.vase(rng, style.accents[0]),
        decor.bowl(style.accents[0]),
        decor.books_lying(rng, style),
        decor.laptop(style),
    ):
        assert item.surface.points_m[..., 2].min() == pytest.approx(0.0, abs=1e-9)
        assert item.footprints == ()
