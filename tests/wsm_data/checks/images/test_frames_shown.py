import numpy as np
import pytest

from wsm_data.checks.images.frames_shown import check_frames_shown
from wsm_data.errors import Reason

VIDEO = np.random.default_rng(0).uniform(-0.5, 0.5, (10, 96, 160)).astype(np.float32)


@pytest.mark.parametrize("value", [-1.0, 1.0])
@pytest.mark.parametrize("frame", [0, 4, 9])
def test_a_black_or_white_image_is_found_wherever_it_stands(value, frame):
    video = VIDEO.copy()
    video[frame] = value
    verdict = check_frames_shown(video, "a/b/0")
    assert verdict.reason is Reason.COLOUR_BLANK
    assert (verdict.measured["frame"], verdict.measured["blank_frames"]) == (frame, 1)


@pytest.mark.parametrize("value", [-0.8, 0.0, 0.8])
def test_a_plain_wall_that_fills_an_image_is_kept(value):
    video = VIDEO.copy()
    video[4] = value
    assert check_frames_shown(video, "a/b/0").keep
