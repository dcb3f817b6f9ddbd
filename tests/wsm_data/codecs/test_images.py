import zlib

import cv2
import numpy as np
import pytest
import simplejpeg

from wsm_data.codecs.images import decode_depth, decode_rgb, depth_codes, rgb_pixels
from wsm_data.codecs.png16 import decode_png16
from wsm_data.errors import DataError, Reason

WHERE = "gibson_d435i/Adrian/000003, frame 7"


def refusal(decode, data):
    with pytest.raises(DataError) as caught:
        decode(data, WHERE)
    assert WHERE in caught.value.message
    return caught.value.reason


def test_colours_come_back_in_the_order_red_green_blue():
    image = np.full((32, 32, 3), (200, 40, 90), np.uint8)
    decoded = decode_rgb(simplejpeg.encode_jpeg(image, quality=100, colorsubsampling="444"), WHERE)
    assert decoded.dtype == np.uint8
    assert np.abs(decoded.astype(int) - image).max() <= 2  # JPEG's own rounding at quality 100


def test_a_grey_jpeg_has_three_equal_channels():
    data = simplejpeg.encode_jpeg(np.full((16, 16, 1), 77, np.uint8), colorspace="GRAY")
    assert (decode_rgb(data, WHERE) == 77).all()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9])
def test_a_cut_jpeg_is_refused_and_not_half_grey(rgb_frames, share):
    data = rgb_frames[0]
    assert refusal(decode_rgb, data[: int(share * len(data))]) is Reason.FRAME_UNDECODABLE


def test_a_jpeg_without_its_end_marker_is_refused(rgb_frames):
    assert refusal(decode_rgb, rgb_frames[0][:-2]) is Reason.FRAME_UNDECODABLE


def test_a_jpeg_whose_entropy_data_is_overwritten_is_refused(rgb_frames):
    data = bytearray(rgb_frames[0])
    middle = len(data) // 2
    data[middle : middle + 200] = bytes(200)
    # OpenCV accepts these bytes with a warning on its own stream: the reason this decoder is strict.
    assert cv2.imdecode(np.frombuffer(bytes(data), np.uint8), cv2.IMREAD_COLOR) is not None
    assert refusal(decode_rgb, bytes(data)) is Reason.FRAME_UNDECODABLE


def test_a_colour_png_comes_back_to_the_bit():
    image = np.random.default_rng(0).integers(0, 256, (9, 14, 3), dtype=np.uint8)
    data = cv2.imencode(".png", image[..., ::-1])[1].tobytes()
    assert np.array_equal(decode_rgb(data, WHERE), image)


@pytest.mark.parametrize("position", [0.3, 0.6, 0.9])
def test_a_colour_png_with_one_flipped_bit_is_refused(position):
    image = np.random.default_rng(0).integers(0, 256, (9, 14, 3), dtype=np.uint8)
    data = bytearray(cv2.imencode(".png", image)[1].tobytes())
    data[int(position * len(data))] ^= 4
    assert refusal(decode_rgb, bytes(data)) is Reason.FRAME_UNDECODABLE


@pytest.mark.parametrize("shape", [(9, 14), (9, 14, 4)])
def test_a_grey_png_and_one_with_transparency_are_no_colour_frames(shape):
    data = cv2.imencode(".png", np.zeros(shape, np.uint8))[1].tobytes()
    assert refusal(decode_rgb, data) is Reason.FRAME_UNDECODABLE


def test_a_depth_png_is_no_colour_frame(depth_frames):
    assert refusal(decode_rgb, depth_frames[0]) is Reason.FRAME_UNDECODABLE


def test_depth_comes_back_to_the_bit(depth_frames, depth_images):
    decoded = decode_depth(depth_frames[1], WHERE)
    assert decoded.dtype == np.uint16
    assert np.array_equal(decoded, depth_images[1])


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.999])
def test_a_cut_depth_png_is_refused(depth_frames, share):
    data = depth_frames[0]
    assert refusal(decode_depth, data[: int(share * len(data))]) is Reason.FRAME_UNDECODABLE


def test_a_changed_byte_in_a_depth_png_is_refused(depth_frames):
    data = bytearray(depth_frames[0])
    data[len(data) // 2] ^= 0xFF
    assert refusal(decode_depth, bytes(data)) is Reason.FRAME_UNDECODABLE


@pytest.mark.parametrize(
    "image",
    [np.zeros((8, 8), np.uint8), np.zeros((8, 8, 3), np.uint8), np.zeros((8, 8, 3), np.uint16)],
    ids=["8-bit grey", "8-bit colour", "16-bit colour"],
)
def test_a_png_that_is_not_16_bit_grey_is_refused_as_such(image):
    assert refusal(decode_depth, cv2.imencode(".png", image)[1].tobytes()) is Reason.DEPTH_NOT_16_BIT


def test_a_png_of_a_rare_form_is_still_decoded(depth_frames, depth_images):
    """OpenCV decodes what the decoder of plain files leaves to it: here a chunk that it does not know."""
    gamma = b"gAMA" + (45455).to_bytes(4, "big")
    chunk = (4).to_bytes(4, "big") + gamma + zlib.crc32(gamma).to_bytes(4, "big")
    rare = depth_frames[0][:33] + chunk + depth_frames[0][33:]
    assert decode_png16(rare) is None
    assert np.array_equal(decode_depth(rare, WHERE), depth_images[0])


def test_pixels_that_a_reader_decoded_pass_as_they_are():
    rgb_u8, raw_u16 = np.zeros((4, 6, 3), np.uint8), np.zeros((4, 6), np.uint16)
    assert rgb_pixels(rgb_u8, "here") is rgb_u8
    assert depth_codes(raw_u16, "here") is raw_u16


@pytest.mark.parametrize(("read", "pixels"), [(rgb_pixels, np.zeros((4, 6, 3))), (depth_codes, np.zeros((4, 6), "u1"))])
def test_pixels_of_another_type_are_the_readers_fault(read, pixels):
    with pytest.raises(ValueError, match=f"here must be .* found {pixels.dtype}"):
        read(pixels, "here")
