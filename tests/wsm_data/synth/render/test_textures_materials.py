from functools import partial

import numpy as np
import pytest

from wsm_data.synth.render import textures_materials as materials

PAINTERS = {
    "plaster": materials.plaster,
    "wood": materials.wood,
    "planks": materials.planks,
    "parquet": materials.parquet,
    "tiles": partial(materials.tiles, count=4, grout=0.6, checker=0.1),
    "brick": materials.brick,
    "carpet": materials.carpet,
    "fabric": materials.fabric,
    "leather": materials.leather,
    "stone": materials.stone,
    "metal": materials.metal,
    "wicker": materials.wicker,
    "stripes": partial(materials.stripes, count=4),
    "ornament": materials.ornament,
    "dots": materials.dots,
    "leaf": materials.leaf,
    "bark": materials.bark,
    "duvet": materials.duvet,
}


@pytest.mark.parametrize("name", PAINTERS)
def test_a_texture_is_a_colour_picture_with_structure_and_the_same_for_the_same_seed(name):
    image = PAINTERS[name](np.random.default_rng(3), 64)
    assert image.shape == (64, 64, 3)
    assert image.min() >= 0
    assert image.max() <= 1.001
    assert image.std() > 0.004
    assert (image == PAINTERS[name](np.random.default_rng(3), 64)).all()


def test_grain_runs_along_u():
    grain = materials.wood(np.random.default_rng(0), 128)[..., 0]
    assert np.abs(np.diff(grain, axis=1)).mean() < 0.5 * np.abs(np.diff(grain, axis=0)).mean()


def test_tiles_have_joints_of_the_grout_s_brightness():
    tiles = materials.tiles(np.random.default_rng(0), 128, count=4, grout=0.3, checker=0.0)[..., 0]
    assert (tiles[0] == 0.3).all()
    assert (tiles[:, 32] == 0.3).all()
    assert tiles[16, 16] > 0.8
