import cv2
import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.images import check_jpeg, check_png16, check_rgb

PIXELS = np.random.default_rng(0).integers(0, 256, (17, 33, 3), dtype=np.uint8)


def encoded(ending, image, *options):
    return memoryview(cv2.imencode(ending, image, list(options))[1].tobytes())


def reason_of(check, data):
    with pytest.raises(DataError, match="frame 7") as caught:
        check(memoryview(data), "frame 7")
    return caught.value.reason


@pytest.mark.parametrize(
    "options",
    [
        (),
        (cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
        (cv2.IMWRITE_JPEG_RST_INTERVAL, 1),
        (cv2.IMWRITE_JPEG_OPTIMIZE, 1, cv2.IMWRITE_JPEG_QUALITY, 30),
    ],
)
def test_the_size_of_any_jpeg_is_read_from_its_header(options):
    assert check_jpeg(encoded(".jpg", PIXELS, *options), "a") == (33, 17)
    assert check_jpeg(encoded(".jpg", PIXELS[..., 0], *options), "a") == (33, 17)


def test_application_segments_and_fill_bytes_before_the_frame_are_passed_over():
    data = bytes(encoded(".jpg", PIXELS))
    exif = b"\xff\xe1" + (2 + 300).to_bytes(2, "big") + b"\xff\xc0" * 150  # looks like frames, is none
    assert check_jpeg(memoryview(data[:2] + exif + b"\xff\xff" + data[2:]), "a") == (33, 17)


def test_the_size_of_a_16_bit_png_is_read_from_its_header():
    assert check_png16(encoded(".png", PIXELS[..., 0].astype(np.uint16)), "a") == (33, 17)


@pytest.mark.parametrize("image", [PIXELS[..., 0], PIXELS, PIXELS.astype(np.uint16)])
def test_any_other_png_is_no_depth(image):
    assert reason_of(check_png16, encoded(".png", image)) is Reason.DEPTH_NOT_16_BIT


JPEG = (check_jpeg, bytes(encoded(".jpg", PIXELS)))
PNG = (check_png16, bytes(encoded(".png", PIXELS[..., 0].astype(np.uint16))))


@pytest.mark.parametrize(("check", "whole"), [JPEG, PNG])
def test_every_cut_of_an_image_is_noticed(check, whole):
    assert reason_of(check, b"") is Reason.FRAME_EMPTY
    for length in range(1, len(whole)):
        assert reason_of(check, whole[:length]) is Reason.FRAME_TRUNCATED


@pytest.mark.parametrize(("check", "other"), [(check_jpeg, PNG[1]), (check_png16, JPEG[1]), (check_jpeg, b"\0" * 99)])
def test_other_files_are_undecodable(check, other):
    assert reason_of(check, other) is Reason.FRAME_UNDECODABLE


def test_a_jpeg_without_a_frame_is_undecodable():
    assert reason_of(check_jpeg, b"\xff\xd8\xff\xd9") is Reason.FRAME_UNDECODABLE
    assert reason_of(check_jpeg, b"\xff\xd8" + b"\0" * 50 + b"\xff\xd9") is Reason.FRAME_UNDECODABLE


def test_a_png_without_a_header_is_undecodable():
    assert reason_of(check_png16, PNG[1][:8] + PNG[1][-12:]) is Reason.FRAME_UNDECODABLE


def test_a_colour_image_is_a_jpeg_or_a_png_of_eight_bit_colours():
    assert check_rgb(encoded(".jpg", PIXELS), "a") == (33, 17)
    assert check_rgb(encoded(".png", PIXELS), "a") == (33, 17)


@pytest.mark.parametrize("image", [PIXELS[..., 0], PIXELS.astype(np.uint16)])
def test_other_kinds_of_png_are_no_colour_images(image):
    assert reason_of(check_rgb, bytes(encoded(".png", image))) is Reason.FRAME_UNDECODABLE


def test_a_cut_colour_png_is_refused():
    assert reason_of(check_rgb, bytes(encoded(".png", PIXELS))[:-5]) is Reason.FRAME_TRUNCATED
