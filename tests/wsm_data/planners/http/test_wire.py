"""Pictures, depth and goals in a request, against decoders that know nothing of ours."""

import io
import json

import cv2
import numpy as np
import pytest
from PIL import Image

from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.wire import (
    decode_depth_m,
    decode_goals,
    decode_image,
    encode_depth,
    encode_goals,
    encode_image,
    read_numbers,
    read_object,
)

LOSS = 12
"""What a JPEG of quality 95 with halved colour may change inside two flat halves: found by trying, plus a third."""


def test_red_and_blue_are_exchanged_in_the_file(red_left):
    data = encode_image(red_left(1))
    with Image.open(io.BytesIO(data)) as image:
        as_file = np.asarray(image)
    assert as_file[8, 4, 2] > 250 - LOSS  # red stands where a plain reader looks for blue
    assert as_file[8, 4, 0] < LOSS


def test_the_file_is_that_of_opencv_which_takes_red_for_blue(red_left):
    _, theirs = cv2.imencode(".jpg", red_left(2).reshape(32, 32, 3))
    assert encode_image(red_left(2)) == theirs.tobytes()


def test_four_frames_stand_one_below_the_other_and_come_back_in_order(red_left):
    data = encode_image(red_left(4))
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape == (64, 32, 3)
    back = decode_image(data, 4)
    assert back.shape == (4, 16, 32, 3)
    assert np.abs(back[:, 8, 28].astype(int) - red_left(4)[:, 8, 28]).max() <= LOSS


def test_depth_is_truncated_clipped_and_infinity_is_the_last_code():
    depth = np.array([[[0.0, 0.12349, 1.99999, 6.5535, 7.0, np.inf, -1.0, 0.00009]]], np.float32)
    codes = cv2.imdecode(np.frombuffer(encode_depth(depth), np.uint8), cv2.IMREAD_UNCHANGED)
    assert codes.dtype == np.uint16
    assert codes.tolist() == [[0, 1234, 19999, 65535, 65535, 65535, 0, 0]]


def test_depth_that_is_no_number_has_no_code():
    with pytest.raises(ValueError, match="NaN"):
        encode_depth(np.array([[[np.nan]]], np.float32))


def test_depth_comes_back_as_ten_thousandths_and_what_was_not_hit_at_its_wall():
    depth = np.array([[[1.5, np.inf]], [[0.25, 6.0]]], np.float32)
    back = decode_depth_m(encode_depth(depth), 2)
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, np.array([[[1.5, 6.5535]], [[0.25, 6.0]]], np.float32))


def test_a_height_that_is_no_multiple_of_the_batch_is_of_a_wrong_batch(red_left):
    with pytest.raises(WireError) as refused:
        decode_image(encode_image(red_left(4)), 3)
    assert refused.value.fault is Fault.WRONG_BATCH


@pytest.mark.parametrize("data", [b"", b"no picture", encode_image(np.zeros((1, 64, 64, 3), np.uint8))[:-40]])
def test_what_is_no_whole_jpeg_is_malformed(data):
    with pytest.raises(WireError) as refused:
        decode_image(data, 1)
    assert refused.value.fault is Fault.MALFORMED


def test_eight_bit_depth_is_malformed():
    _, grey = cv2.imencode(".png", np.zeros((4, 4), np.uint8))
    with pytest.raises(WireError) as refused:
        decode_depth_m(grey.tobytes(), 1)
    assert refused.value.fault is Fault.MALFORMED


def test_a_file_that_claims_a_huge_size_is_refused_before_it_is_decoded():
    data = bytearray(encode_depth(np.ones((1, 2, 2), np.float32)))
    data[16:24] = (60000).to_bytes(4, "big") * 2
    with pytest.raises(WireError) as refused:
        decode_depth_m(bytes(data), 1)
    assert refused.value.fault is Fault.TOO_LARGE


def test_goals_are_two_lists_of_numbers_and_come_back_exactly():
    goals = np.array([[1.1, -2.0], [0.1 + 0.2, 4.0]])
    assert json.loads(encode_goals(goals)) == {"goal_x": [1.1, 0.30000000000000004], "goal_y": [-2.0, 4.0]}
    np.testing.assert_array_equal(decode_goals(encode_goals(goals), 2), goals)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('{"goal_x": [1.0], "goal_y": [NaN]}', Fault.NOT_FINITE),
        ('{"goal_x": [1.0], "goal_y": [1e999]}', Fault.NOT_FINITE),
        ('{"goal_x": [1.0, 2.0], "goal_y": [1.0, 2.0]}', Fault.WRONG_BATCH),
        ('{"goal_x": [1.0]}', Fault.MALFORMED),
        ('{"goal_x": ["1"], "goal_y": [1.0]}', Fault.MALFORMED),
        ('{"goal_x": [true], "goal_y": [1.0]}', Fault.MALFORMED),
        ("[1.0]", Fault.MALFORMED),
        ("{", Fault.MALFORMED),
        ("[" * 100_000, Fault.MALFORMED),
    ],
)
def test_goals_of_another_form_are_refused_by_name(text, fault):
    with pytest.raises(WireError) as refused:
        decode_goals(text, 1)
    assert refused.value.fault is fault


def test_lists_of_different_lengths_are_malformed():
    with pytest.raises(WireError) as refused:
        read_numbers(read_object('{"a": [[1, 2], [3]]}', "text"), "a", (2, None))
    assert refused.value.fault is Fault.MALFORMED
