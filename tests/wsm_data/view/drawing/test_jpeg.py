import numpy as np
import pytest
import simplejpeg

from wsm_data.view.drawing.jpeg import jpeg, thumbnail

RAMP = np.broadcast_to(np.linspace(0, 255, 640).astype(np.uint8)[None, :, None], (360, 640, 3))


def test_a_picture_comes_back_nearly_as_it_was():
    back = simplejpeg.decode_jpeg(jpeg(RAMP))
    assert np.abs(back.astype(int) - RAMP).max() <= 4  # a smooth picture at quality 88


@pytest.mark.parametrize(
    ("size", "wanted"), [((360, 640), (180, 320)), ((2, 4000), (1, 320)), ((100, 200), (100, 200))]
)
def test_a_thumbnail_is_at_most_320_wide_and_never_larger_than_its_picture(size, wanted):
    picture = np.full((*size, 3), 77, np.uint8)
    assert simplejpeg.decode_jpeg(thumbnail(picture)).shape == (*wanted, 3)
