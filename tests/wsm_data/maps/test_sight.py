import numpy as np
import pytest

from wsm_data.maps.sight import clip_slopes, segment_is_clear


def test_segments_see_each_other_exactly_where_they_touch_no_opaque_square(sees):
    rng = np.random.default_rng(0)
    outcomes = set()
    for _ in range(1500):
        opaque = rng.random((9, 9)) > 0.8
        a, b = rng.integers(0, 9, (2, 2))
        expected = sees(opaque, tuple(a), tuple(b))
        assert segment_is_clear(opaque, a[0] + 0.5, a[1] + 0.5, b[0] + 0.5, b[1] + 0.5) == expected
        assert segment_is_clear(opaque, b[0] + 0.5, b[1] + 0.5, a[0] + 0.5, a[1] + 0.5) == expected
        outcomes.add(expected)
    assert outcomes == {True, False}


def test_touching_a_corner_ends_the_view():
    opaque = np.zeros((4, 4), np.bool_)
    opaque[1, 2] = True  # the diagonal through (2, 2) touches its upper left corner
    assert not segment_is_clear(opaque, 0.5, 0.5, 3.5, 3.5)
    assert segment_is_clear(opaque, 0.4, 0.5, 3.4, 3.6)


@pytest.mark.parametrize(
    ("offset", "gradient", "expected"),
    [(-1.0, 2.0, (0.0, 0.5)), (1.0, -2.0, (0.5, 1.0)), (-1.0, 0.0, (0.0, 1.0)), (1.0, 0.0, (0.0, 0.0))],
)
def test_slopes_are_cut_to_a_half_plane(offset, gradient, expected):
    assert clip_slopes(0.0, 1.0, offset, gradient) == expected
