import numpy as np
import pytest

from wsm_data.synth.render import textures_pictures as pictures

PAINTERS = {
    name: getattr(pictures, name)
    for name in (
        "garden_view",
        "town_view",
        "hills",
        "sea",
        "circles",
        "blocks",
        "strokes",
        "flower",
        "rug_border",
        "rug_geometric",
        "rug_striped",
        "book",
        "screen",
        "mirror",
    )
}


@pytest.mark.parametrize("name", PAINTERS)
def test_a_picture_is_in_range_has_contrast_and_is_the_same_for_the_same_seed(name):
    image = PAINTERS[name](np.random.default_rng(5), 64)
    assert image.shape == (64, 64, 3)
    assert image.min() >= 0
    assert image.max() <= 1.001
    assert image.std() > 0.03
    assert (image == PAINTERS[name](np.random.default_rng(5), 64)).all()


def test_views_have_their_sky_above():
    for view in (pictures.garden_view, pictures.town_view):
        image = view(np.random.default_rng(1), 64)
        sky, ground = image[:6].mean(axis=(0, 1)), image[-6:].mean(axis=(0, 1))
        assert sky[2] > sky[0]
        assert sky.sum() > ground.sum()


def test_palettes_start_with_a_pale_ground():
    for seed in range(8):
        ground, *others = pictures.pick_palette(np.random.default_rng(seed))
        assert len(others) == 4
        assert sum(ground) > max(sum(colour) for colour in others)
