import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.codecs.depth import (
    depth_m_from_latent_video,
    depth_m_from_raw,
    is_measured,
    log_depth_table,
    measured_table,
    normalise_depth,
    valid_share,
)
from wsm_data.schema.depth import DepthEncoding, DepthRange

ENCODING = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
RANGE = DepthRange()


def test_the_range_maps_to_minus_one_and_one_and_its_geometric_middle_to_zero():
    wanted = normalise_depth(np.array([0.2, 1.0, 5.0]), RANGE)  # 1 m is the geometric mean of 0.2 and 5
    np.testing.assert_allclose(wanted, [-1, 0, 1], atol=1e-7)


def test_depth_outside_the_range_is_clipped():
    assert normalise_depth(np.array([0.01, 60.0]), RANGE).tolist() == [-1, 1]


@pytest.mark.parametrize("nothing", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_what_is_no_measurement_becomes_the_far_end(nothing):
    assert normalise_depth(np.array([nothing]), RANGE).tolist() == [1]


def test_the_table_holds_the_formula_for_every_code():
    table = log_depth_table(ENCODING, RANGE)
    assert table.dtype == np.float32
    assert table.shape == (65536,)
    for code in (1, 1999, 2000, 2001, 10_000, 33_333, 49_999, 50_000, 65_534):
        depth_m = min(max(code * 1e-4, 0.2), 5.0)
        assert table[code] == pytest.approx(2 * np.log(depth_m / 0.2) / np.log(25) - 1, abs=1e-7)
    assert table[0] == table[65535] == 1


def test_the_table_follows_the_encoding_of_the_source():
    millimetres = DepthEncoding(metres_per_unit=1e-3, invalid_codes=(0, 7))
    table = log_depth_table(millimetres, RANGE)
    assert table[1000] == pytest.approx(0, abs=1e-7)
    assert table[7] == 1
    assert table[8] == -1
    codes = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    assert np.argwhere(~is_measured(codes, millimetres)).tolist() == [[0, 0], [0, 7]]


def test_raw_codes_become_metres_rounded_once_and_zero_where_nothing_was_measured():
    codes = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    depth_m = depth_m_from_raw(codes, ENCODING)
    assert depth_m.dtype == np.float32
    assert depth_m[codes == 10_000] == 1
    wanted = [0 if code in (0, 65535) else np.float32(code * 1e-4) for code in codes.ravel().tolist()]
    assert np.array_equal(depth_m.ravel(), wanted)


@given(depth_m=st.floats(0.2, 5.0))
def test_metres_come_back_through_the_video(depth_m):
    grey = np.broadcast_to(normalise_depth(np.array([[[[depth_m]]]]), RANGE), (1, 1, 1, 3))
    # A float32 step of 2u - 1 is 6e-8 at most; half the log range of 3.2 times that, times the depth.
    assert depth_m_from_latent_video(grey, RANGE)[0, 0, 0] == pytest.approx(depth_m, rel=3e-7)


def test_decoded_channels_are_averaged_then_clamped():
    video = np.array([[[[-0.3, 0.0, 0.3]], [[1.5, 1.2, 1.8]], [[-3.0, -1.0, -1.0]]]], np.float32)
    np.testing.assert_allclose(depth_m_from_latent_video(video, RANGE)[0, :, 0], [1.0, 5.0, 0.2], rtol=1e-6)


def test_the_table_of_measured_codes_says_of_each_what_is_said_of_images():
    encoding = DepthEncoding(metres_per_unit=1e-3, invalid_codes=(0, 7))
    assert np.flatnonzero(~measured_table(encoding)).tolist() == [0, 7]
    assert len(measured_table(encoding)) == 65536


def test_the_valid_share_counts_frame_0_alone_and_then_four_at_a_time():
    valid = np.zeros((9, 32, 48), bool)
    valid[0, :16, :16] = True
    valid[1:5, 16:, 16:32] = True
    valid[8, :8, 32:] = True
    shares = valid_share(valid)
    assert shares.dtype == np.uint8
    assert shares.shape == (3, 2, 3)
    wanted = np.zeros((3, 2, 3))
    wanted[0, 0, 0] = wanted[1, 1, 1] = 255
    wanted[2, 0, 2] = 32  # an eighth of 255 is 31.875
    assert np.array_equal(shares, wanted)


def test_the_valid_share_agrees_with_a_plain_count():
    valid = np.random.default_rng(0).random((13, 32, 32)) < 0.7
    shares = valid_share(valid)
    for j, frames in enumerate([slice(0, 1), slice(1, 5), slice(5, 9), slice(9, 13)]):
        for row in range(2):
            for column in range(2):
                cell = valid[frames, 16 * row : 16 * row + 16, 16 * column : 16 * column + 16]
                assert shares[j, row, column] == round(255 * int(cell.sum()) / cell.size)


def test_halves_are_rounded_to_even():
    valid = np.zeros((1, 16, 32), bool)
    valid[0, :8, :16] = True  # 128 of 256 pixels: 127.5
    assert valid_share(valid).tolist() == [[[128, 0]]]


@pytest.mark.parametrize("shape", [(2, 16, 16), (1, 17, 16), (1, 16, 8)])
def test_masks_that_do_not_fit_the_latents_are_refused(shape):
    with pytest.raises(ValueError, match="1 \\+ 4k"):
        valid_share(np.zeros(shape, bool))
