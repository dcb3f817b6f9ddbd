import dataclasses

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.schema.depth import DepthRange
from wsm_data.view.clip.pictures import decode_pictures, spread_frames
from wsm_data.view.drawing.depth_colours import INVALID_GREY, depth_picture


@pytest.mark.parametrize(
    ("frames", "count", "expected"),
    [(13, 4, (0, 4, 8, 12)), (3, 12, (0, 1, 2)), (1, 6, (0,)), (9, 1, (0,))],
)
def test_frames_are_spread_from_the_first_to_the_last(frames, count, expected):
    assert spread_frames(frames, count) == expected


def test_pictures_show_what_was_encoded(clip, made):
    pictures = decode_pictures(clip, made.codec, (0, 8))
    video = made.codec.decode(clip.rgb_latent.astype(np.float32))
    assert pictures.frames == (0, 8)
    assert pictures.rgb_u8.shape == pictures.depth_u8.shape == (2, 32, 64, 3)
    assert np.abs(pictures.rgb_u8 / 127.5 - 1 - video[[0, 8]]).max() < 1 / 127.5
    expected = depth_picture(np.broadcast_to(np.linspace(0.5, 4.5, 64), (32, 64)), DepthRange())
    seen = pictures.depth_u8[0].astype(int)
    assert (
        np.abs(seen - expected)[:, 8:-8].mean() < 8
    )  # of 255: the codec blurs, but the colours are those of the depth


def test_cells_that_were_mostly_not_measured_are_grey_in_the_frames_of_their_latent(clip, made):
    pictures = decode_pictures(clip, made.codec, (0, 1, 4, 5))  # cell (0, 0) of latent 1 holds frames 1 to 4
    grey = (pictures.depth_u8[:, :16, :16] == INVALID_GREY).all(axis=(1, 2, 3))
    assert grey.tolist() == [False, True, True, False]
    assert not (pictures.depth_u8[:, 16:] == INVALID_GREY).all(axis=-1).any()
    assert pictures.depth_valid_share == pytest.approx([1, 7 / 8, 7 / 8, 1])


def test_a_clip_of_another_codec_is_not_decoded(clip, made):
    other = dataclasses.replace(clip, meta=dataclasses.replace(clip.meta, codec_digest="another"))
    with pytest.raises(ConfigError, match="another"):
        decode_pictures(other, made.codec, (0,))
