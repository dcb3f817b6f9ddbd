import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.synth.atlas import pack_colours
from wsm_data.synth.rasteriser import _blend, _light, _texel


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


def two_levels() -> tuple[np.ndarray, np.ndarray]:
    """A 2 x 2 texture of 0, 100, 200, 40 and its mean 85."""
    texels = pack_colours(np.repeat(np.array([0, 100, 200, 40, 85])[:, None], 3, axis=1))
    return texels, np.array([0, 4], np.int64)


def test_a_texel_shows_its_own_colour_at_its_centre_and_repeats():
    texels, offsets = two_levels()
    for u, v, value in ((0.5, 0.5, 0), (1.5, 0.5, 100), (0.5, 1.5, 200), (3.5, 3.5, 40)):
        assert channel(_texel(texels, offsets, 1, u + 2, v + 2, 0.1), 0) == value << 8


def test_a_pixel_that_covers_many_texels_sees_their_mean():
    texels, offsets = two_levels()
    assert channel(_texel(texels, offsets, 1, 2.5, 2.5, 4.0), 0) == 85 << 8
    assert channel(_texel(texels, offsets, 1, 2.5, 2.5, 1e9), 2) == 85 << 8


def test_light_is_interpolated_between_nodes_and_held_at_the_edges():
    nodes = pack_colours(np.repeat(np.array([0, 64, 128, 512, 512, 512])[:, None], 3, axis=1))
    assert channel(_light(nodes, 0, 3, 2, 0.5, 0.0), 0) == 32 * 64
    assert channel(_light(nodes, 0, 3, 2, 1.0, 0.0), 1) == 64 * 64
    assert channel(_light(nodes, 0, 3, 2, -0.3, -0.1), 2) == 0
    assert abs(channel(_light(nodes, 0, 3, 2, 9.0, 0.0), 0) - 128 * 64) <= 64  # one of 64 steps before the last node
