from fractions import Fraction
from math import floor

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.codecs.depth import log_depth_table, measured_table
from wsm_data.codecs.resize import resize_colour, resize_depth
from wsm_data.schema.depth import DepthEncoding, DepthRange

ENCODING = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
TABLE, MEASURED = log_depth_table(ENCODING, DepthRange()), measured_table(ENCODING)

sizes = st.tuples(st.integers(1, 40), st.integers(1, 40))


def resized_colour(image, width, height):
    out = np.full((height, width, 3), np.nan, np.float32)
    resize_colour(image, out)
    return out


def resized_depth(raw, width, height):
    out, valid = np.full((height, width), np.nan, np.float32), np.zeros((height, width), bool)
    resize_depth(raw, TABLE, MEASURED, out, valid)
    return out, valid


def shares(before, after):
    """Share of each source pixel in each target pixel of an axis, as fractions."""

    def share(target, source):
        low = max(Fraction(target * before, after), Fraction(source))
        high = min(Fraction((target + 1) * before, after), Fraction(source + 1))
        return max(high - low, Fraction(0)) * Fraction(after, before)

    return np.array([[share(target, source) for source in range(before)] for target in range(after)])


@settings(max_examples=40, deadline=None)
@given(source=sizes, target=st.tuples(st.integers(1, 12), st.integers(1, 12)))
def test_colour_is_the_mean_over_the_area_of_each_target_pixel_to_the_last_bits(source, target):
    image = np.random.default_rng(sum(source)).integers(0, 256, (*source, 3)).astype(np.uint8)
    rows, columns = shares(source[0], target[0]), shares(source[1], target[1])
    exact = np.einsum("yr,rcs,xc->yxs", rows, image.astype(object), columns, optimize=True)
    wanted = (exact / Fraction(255, 2) - 1).astype(np.float64)
    # One subtraction and one division, each rounded to float32, of numbers that are exact below 2^24.
    np.testing.assert_allclose(resized_colour(image, target[1], target[0]), wanted, rtol=0, atol=2**-23)


@pytest.mark.parametrize("size", [(480, 270), (640, 360), (1280, 720), (321, 193)])
@pytest.mark.parametrize(("level", "value"), [(0, -1), (255, 1)])
def test_black_and_white_stay_black_and_white_to_the_bit(size, level, value):
    image = np.full((size[1], size[0], 3), level, np.uint8)
    assert (resized_colour(image, 320, 192) == value).all()


def test_an_image_whose_sums_leave_32_bits_is_resized_alike():
    image = np.random.default_rng(1).integers(0, 256, (2999, 3001, 3)).astype(np.uint8)  # 255 * 2999 * 3001 > 2^31
    wanted = cv2.resize(image.astype(np.float64), (16, 16), interpolation=cv2.INTER_AREA) / 127.5 - 1
    np.testing.assert_allclose(resized_colour(image, 16, 16), wanted, atol=1e-6)


def test_the_mean_is_within_a_rounding_of_what_opencv_makes_of_a_real_size():
    image = np.random.default_rng(2).integers(0, 256, (270, 480, 3)).astype(np.uint8)
    theirs = cv2.resize(image, (320, 192), interpolation=cv2.INTER_AREA)
    assert np.abs((resized_colour(image, 320, 192) + 1) * 127.5 - theirs).max() <= 0.501  # theirs is in whole levels


def test_an_image_of_the_wanted_size_is_only_normalised():
    image = np.random.default_rng(3).integers(0, 256, (32, 48, 3)).astype(np.uint8)
    assert np.array_equal(resized_colour(image, 48, 32), ((image - np.float32(127.5)) / np.float32(127.5)))


def test_a_view_with_gaps_is_resized_as_its_copy():
    image = np.random.default_rng(4).integers(0, 256, (20, 30, 6)).astype(np.uint8)[..., ::2]
    assert np.array_equal(resized_colour(image, 7, 5), resized_colour(image.copy(), 7, 5))


@settings(max_examples=40, deadline=None)
@given(source=st.tuples(st.integers(1, 70), st.integers(1, 70)), target=sizes)
def test_depth_takes_the_pixel_in_which_the_centre_lies(source, target):
    def picked(before, after):
        return [floor((i + Fraction(1, 2)) * Fraction(before, after)) for i in range(after)]

    raw = np.random.default_rng(0).integers(0, 65536, source).astype(np.uint16)
    codes = raw[np.ix_(picked(source[0], target[0]), picked(source[1], target[1]))]
    out, valid = resized_depth(raw, target[1], target[0])
    assert np.array_equal(out, TABLE[codes])
    assert np.array_equal(valid, MEASURED[codes])


@pytest.mark.parametrize("size", [(480, 270), (640, 360)])
def test_the_sizes_of_the_source_are_aligned_at_pixel_centres(size):
    width, height = size
    columns = np.broadcast_to(np.arange(1, width + 1, dtype=np.uint16), (height, width))
    wanted = np.floor((np.arange(320) + 0.5) * width / 320).astype(int) + 1
    assert np.array_equal(resized_depth(columns, 320, 192)[0][0], TABLE[wanted])


def test_codes_without_a_measurement_are_far_and_not_valid():
    raw = np.array([[0, 65535, 1, 65534]], np.uint16)
    out, valid = resized_depth(raw, 4, 1)
    assert valid.tolist() == [[False, False, True, True]]
    assert out.tolist() == [[1.0, 1.0, -1.0, 1.0]]
