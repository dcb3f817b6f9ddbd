import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsm_data.synth.writers.images import add_noise, depth_codes, encode_jpeg, encode_png_16, noise_tile


@given(arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9))), st.integers(0, 3))
def test_the_16_bit_png_is_read_back_by_opencv_to_the_bit(codes, level):
    image = cv2.imdecode(np.frombuffer(encode_png_16(codes, level), np.uint8), cv2.IMREAD_UNCHANGED)
    assert image.dtype == np.uint16
    assert (image == codes).all()


def test_smooth_depth_is_compressed():
    ramp = (20_000 + np.arange(270)[:, None] * 30 + np.zeros((1, 480))).astype(np.uint16)
    assert len(encode_png_16(ramp, 2)) < 0.1 * ramp.nbytes


def test_depth_is_rounded_to_tenths_of_millimetres_and_zero_where_unknown_or_too_far():
    depth_m = np.array([[0.0, 1.00004, 1.00006, 6.5534, 6.5535, 7.0]], np.float32)
    assert depth_codes(depth_m, 1e-4).tolist() == [[0, 10000, 10001, 65534, 0, 0]]


def test_noise_has_its_deviation_and_moves_from_frame_to_frame():
    rng = np.random.default_rng(0)
    tile = noise_tile(rng, 60, 80, 3.0)
    grey = np.full((60, 80, 3), 128, np.uint8)
    first, second = add_noise(grey, tile, rng), add_noise(grey, tile, rng)
    assert (first.astype(int) - 128).std() == pytest.approx(3.0, rel=0.05)
    assert (first != second).mean() > 0.5
    assert (grey == 128).all()


def test_noise_stops_at_black_and_white():
    rng = np.random.default_rng(0)
    tile = noise_tile(rng, 20, 20, 30.0)
    for value in (0, 255):
        noisy = add_noise(np.full((20, 20, 3), value, np.uint8), tile, rng)
        assert (noisy == value).mean() > 0.4
        assert np.abs(noisy.astype(int) - value).max() < 200


def test_a_jpeg_keeps_colours_and_their_order():
    picture = np.zeros((32, 32, 3), np.uint8)
    picture[..., 0], picture[..., 1] = 200, 90
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(picture, 92), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert np.abs(decoded.astype(int) - picture).max() <= 3
