import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.synth.render.atlas import pack_colours
from wsm_data.synth.render.rasteriser import _blend, _level, _light, _texel


def channel(packed: int, number: int) -> int:
    return (packed >> (16 * number)) & 0xFFFF


@given(st.integers(0, 255), st.integers(0, 255), st.integers(0, 255))
def test_the_mean_of_four_equal_samples_is_the_sample_at_any_weights(value, fs, ft):
    samples = pack_colours(np.full((4, 3), value))
    mixed = _blend(samples, 0, 1, 2, 3, fs, ft, 8)
    assert [channel(mixed, k) for k in range(3)] == [value << 8] * 3


def test_channels_are_weighed_without_spilling_into_one_another():
    samples = pack_colours(np.array([[255, 0, 255], [255, 255, 0], [0, 0, 255], [0, 255, 0]]))
    mixed = _blend(samples, 0, 1, 2, 3, 64, 128, 8)
    assert [channel(mixed, k) / 256 for k in range(3)] == [127.5, 63.75, 191.25]


def test_a_texel_shows_its_own_colour_at_its_centre_and_repeats():
    texels = pack_colours(np.repeat(np.array([0, 100, 200, 40])[:, None], 3, axis=1))
    for u, v, value in ((0.5, 0.5, 0), (1.5, 0.5, 100), (0.5, 1.5, 200), (3.5, 3.5, 40)):
        assert channel(_texel(texels, 0, 1, int(256 * (u + 2)), int(256 * (v + 2))), 0) == value << 8
    assert channel(_texel(texels, 0, 1, int(256 * 3.0), int(256 * 2.5)), 0) == 50 << 8  # half way from 0 to 100


def test_the_level_has_texels_about_as_large_as_the_pixel():
    # a pixel over A texels of level 0 covers A / 4^n of level n; that is brought to at most 2
    assert [_level(area, 8) for area in (0.01, 1.9, 2.1, 7.9, 8.1, 130.0)] == [0, 0, 1, 1, 2, 4]
    assert _level(1e12, 8) == 8


def test_light_is_interpolated_between_nodes_and_held_at_the_edges():
    nodes = pack_colours(np.repeat(np.array([0, 64, 128, 512, 512, 512])[:, None], 3, axis=1))
    assert channel(_light(nodes, 0, 3, 2, 0.5, 0.0), 0) == 32 * 64
    assert channel(_light(nodes, 0, 3, 2, 1.0, 0.0), 1) == 64 * 64
    assert channel(_light(nodes, 0, 3, 2, -0.3, -0.1), 2) == 0
    assert abs(channel(_light(nodes, 0, 3, 2, 9.0, 0.0), 0) - 128 * 64) <= 64  # one of 64 steps before the last node
