"""A pattern that moves by whole pixels, as a camera sees it that goes along a wall."""

import numpy as np
import pytest

from wsm_data.checks.images.frame_order import check_frame_order, signatures
from wsm_data.errors import Reason

FRAMES = 30
X = np.arange(320)
ROWS = np.sin(np.arange(192) / 40)[:, None]
VIDEO = np.stack([np.sin((X + t) / 50) + ROWS + np.sin((X + t) / 17) for t in range(FRAMES)]).astype(np.float32)


def found(video):
    return check_frame_order(video, "colour", "a/b/0")


def test_a_sound_video_is_kept_at_any_exposure_and_speed():
    exposed = VIDEO * np.linspace(0.3, 1.0, FRAMES, dtype=np.float32)[:, None, None]
    for video in (VIDEO, exposed, VIDEO[::10], VIDEO[:2], VIDEO[:1]):
        assert found(video).keep


def test_steady_motion_has_the_way_around_a_frame_as_long_as_both_ways_to_it():
    """The nearer end is half as far as the way around; limit is twice as far and more."""
    assert found(VIDEO).measured["colour_foreign_ratio"] <= 0.5


def test_a_frame_of_another_video_is_found():
    video = VIDEO.copy()
    video[10] = VIDEO[3, ::-1, ::-1] ** 2
    verdict = found(video)
    assert verdict.reason is Reason.FRAME_OUT_OF_ORDER
    assert (verdict.measured["frame"], verdict.measured["frames"]) == (10, 1)


def test_a_camera_that_turns_to_the_side_and_back_is_kept():
    there = VIDEO[::6]
    assert found(np.concatenate([there, there[::-1]])).keep


@pytest.mark.parametrize("value", [-1.0, 0.0, 1.0])
def test_a_frame_of_one_colour_is_found(value):
    video = VIDEO.copy()
    video[20] = value
    assert found(video).measured["frame"] == 20


def test_the_rim_of_a_door_that_is_nearer_for_one_frame_is_no_foreign_image():
    """It covers half a block more for the length of a frame, as where the camera wavers."""
    scene = np.full((FRAMES, 96, 160), 0.5, np.float32)
    scene[:, :, 104:] = -1.0
    scene[12, :, 98:104] = -1.0
    assert found(scene).keep


def test_two_frames_that_were_exchanged_are_found():
    video = VIDEO.copy()
    video[[5, 22]] = video[[22, 5]]
    assert found(video).measured["frames"] == 2


def test_signatures_do_not_know_exposure():
    np.testing.assert_allclose(signatures(0.3 * VIDEO + 0.2), signatures(VIDEO), atol=1e-4)
