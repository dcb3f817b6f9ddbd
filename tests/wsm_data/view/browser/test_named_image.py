import tarfile

import cv2
import numpy as np
import pytest
import simplejpeg

from wsm_data.errors import ConfigError
from wsm_data.view.browser.named_image import decode_damaged, named_image

PICTURE = np.random.default_rng(0).integers(0, 255, (64, 96, 3), np.uint8)


@pytest.mark.parametrize(
    ("message", "named"),
    [
        ("g/home_0001:videos/a b.jpg: a JPEG ends with ff d9", ("g/home_0001", "videos/a b.jpg")),
        ("g/home.tar.gz:x/1.PNG must be", ("g/home.tar.gz", "x/1.PNG")),
        ("g/home_0001/000003: between frames a camera may move", None),
        ("g/home.tar.gz: the gzip stream ends", None),
        ("", None),
    ],
)
def test_a_message_names_an_image_or_none(message, named):
    assert named_image(message) == named


def test_the_upper_part_of_a_cut_jpeg_is_shown(tmp_path):
    (tmp_path / "home").mkdir()
    whole = simplejpeg.encode_jpeg(PICTURE, 95, "RGB", "444")
    (tmp_path / "home" / "1.jpg").write_bytes(whole[: len(whole) // 2])
    shown = decode_damaged(tmp_path, "home", "1.jpg")
    assert shown.shape == PICTURE.shape
    assert np.array_equal(shown[:16], simplejpeg.decode_jpeg(whole)[:16])


def test_an_image_in_an_archive_and_one_of_sixteen_bits_are_shown(tmp_path):
    _, data = cv2.imencode(".png", np.full((4, 5), 65535, np.uint16))
    (tmp_path / "1.png").write_bytes(data.tobytes())
    with tarfile.open(tmp_path / "home.tar", "w", format=tarfile.USTAR_FORMAT) as archive:
        archive.add(tmp_path / "1.png", "depth/1.png")
    assert decode_damaged(tmp_path, "home.tar", "depth/1.png").tolist() == np.full((4, 5, 3), 255).tolist()


@pytest.mark.parametrize(
    ("container", "member"),
    [("..", "secret.jpg"), ("home", "../../secret.jpg"), ("home", "link.jpg"), ("home", "none.jpg"), ("none", "1.jpg")],
)
def test_nothing_outside_the_source_is_shown(tmp_path, container, member):
    source = tmp_path / "source"
    (source / "home").mkdir(parents=True)
    (tmp_path / "secret.jpg").write_bytes(simplejpeg.encode_jpeg(PICTURE))
    (source / "home" / "link.jpg").symlink_to(tmp_path / "secret.jpg")
    with pytest.raises(ConfigError):
        decode_damaged(source, container, member)


def test_a_file_that_is_no_image_is_said_to_be_none(tmp_path):
    (tmp_path / "home").mkdir()
    for content in (b"", b"text", b"\xff\xd8"):
        (tmp_path / "home" / "1.jpg").write_bytes(content)
        with pytest.raises(ConfigError, match=r"nothing of home:1\.jpg can be shown"):
            decode_damaged(tmp_path, "home", "1.jpg")
