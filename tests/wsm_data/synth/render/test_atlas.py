import numpy as np
import pytest

from wsm_data.synth.render.atlas import pack_colours, paint_atlas
from wsm_data.synth.render.surface import Texture


@pytest.fixture(scope="module")
def atlas():
    return paint_atlas(np.random.default_rng(0), {Texture.LEAF, Texture.BOOK})


def level(atlas, texture: Texture, number: int) -> np.ndarray:
    side = 1 << (int(atlas.size_bits[texture]) - number)
    start = int(atlas.level_offsets[texture, number])
    packed = atlas.texels[start : start + side * side].reshape(side, side)
    return np.stack([(packed >> shift) & 0xFFFF for shift in (0, 16, 32)], axis=-1)


def test_every_level_is_the_mean_of_the_one_below(atlas):
    for number in range(1, int(atlas.size_bits[Texture.LEAF]) + 1):
        big = level(atlas, Texture.LEAF, number - 1).astype(float)
        mean = (big[::2, ::2] + big[1::2, ::2] + big[::2, 1::2] + big[1::2, 1::2]) / 4
        # both levels were rounded to whole numbers
        assert np.abs(level(atlas, Texture.LEAF, number) - mean).max() <= 1.0


def test_layers_that_are_not_used_are_plain_white(atlas):
    assert (level(atlas, Texture.BRICK, 0) == 255).all()
    assert (atlas.mean[Texture.BRICK] == 1).all()


def test_a_layer_does_not_depend_on_which_others_are_painted(atlas):
    alone = paint_atlas(np.random.default_rng(0), {Texture.LEAF})
    assert (level(alone, Texture.LEAF, 0) == level(atlas, Texture.LEAF, 0)).all()


def test_the_mean_colour_is_that_of_the_coarsest_level(atlas):
    coarsest = level(atlas, Texture.BOOK, int(atlas.size_bits[Texture.BOOK]))[0, 0]
    assert np.abs(coarsest / 255 - atlas.mean[Texture.BOOK]).max() < 1 / 255


def test_packing_keeps_each_channel_in_its_sixteen_bits():
    assert pack_colours(np.array([[1, 2, 3], [255, 0, 65535]])).tolist() == [1 | 2 << 16 | 3 << 32, 255 | 65535 << 32]
