import numpy as np
import pytest

from wsm_data.schema.depth import DepthRange
from wsm_data.view.drawing.depth_colours import INVALID_GREY, depth_gradient, depth_picture, draw_depth_bar
from wsm_data.view.drawing.style import figure_style, new_figure

RANGE = DepthRange()


def lightness(rgb_u8: np.ndarray) -> np.ndarray:
    """CIE lightness L* of sRGB colours (IEC 61966-2-1 and CIE 15), 0 to 100."""
    linear = np.where(rgb_u8 <= 10, rgb_u8 / 255 / 12.92, ((rgb_u8 / 255 + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    return np.where(luminance > 216 / 24389, 116 * np.cbrt(luminance) - 16, luminance * 24389 / 27)


def test_lightness_falls_evenly_with_depth():
    depth_m = np.linspace(0.2, 5, 17)[None]
    steps = np.diff(lightness(depth_picture(depth_m, RANGE)[0]))
    assert (steps < 0).all()
    # Viridis spans 91 to 15 in L*: 76 over 16 steps; a step may be off by a quarter through 8-bit rounding.
    assert steps == pytest.approx(np.full(16, -76 / 16), rel=0.25)


@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf])
def test_no_measurement_is_grey(hole):
    picture = depth_picture(np.array([[1.0, hole]]), RANGE)
    assert tuple(picture[0, 1]) == INVALID_GREY
    assert tuple(picture[0, 0]) != INVALID_GREY


def test_the_mask_takes_measurements_away():
    valid = np.array([[True, False]])
    picture = depth_picture(np.array([[1.0, 1.0]]), RANGE, valid)
    assert tuple(picture[0, 1]) == INVALID_GREY
    assert tuple(picture[0, 0]) != INVALID_GREY


def test_depth_beyond_the_range_takes_the_colour_of_the_nearer_end():
    picture = depth_picture(np.array([[0.05, 0.2, 5.0, 80.0]]), RANGE)
    assert np.array_equal(picture[0, 0], picture[0, 1])
    assert np.array_equal(picture[0, 2], picture[0, 3])
    assert not np.array_equal(picture[0, 1], picture[0, 2])


def test_grey_is_no_colour_of_the_map():
    colours = depth_picture(np.linspace(0.2, 5, 1000)[None], RANGE)[0].astype(int)
    assert np.abs(colours - INVALID_GREY).sum(axis=1).min() > 60  # of at most 765


def test_the_bar_is_in_metres_and_ends_with_the_range():
    with figure_style():
        axes = new_figure(100, 200).add_subplot()
        draw_depth_bar(axes, RANGE)
    assert axes.get_ylabel() == "depth (m)"
    assert axes.get_yticks().tolist() == pytest.approx([0.2, 1, 2, 3, 4, 5])
    assert axes.get_ylim() == (0.2, 5.0)


def test_the_gradient_runs_from_the_nearest_to_the_farthest_colour():
    near, far = depth_picture(np.array([[0.2, 5.0]]), RANGE)[0].tolist()
    gradient = depth_gradient(5)
    colours = gradient[gradient.index("rgb") :]
    assert colours.startswith("rgb({} {} {})".format(*near))
    assert colours.endswith("rgb({} {} {}))".format(*far))
    assert gradient.count("rgb(") == 5
