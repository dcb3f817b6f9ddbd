import dataclasses

import numpy as np
import pytest

from wsm_data.checks.images.frames_repeat import check_frames_repeat
from wsm_data.errors import Reason
from wsm_data.schema.frames import EpisodeFrames

RGB = tuple(np.full((2, 3, 3), t, np.uint8) for t in range(10))
DEPTH = tuple(f"depth {t}".encode() for t in range(10))


def check(record, rgb=RGB, depth=DEPTH, max_share=0.0):
    return check_frames_repeat(record, EpisodeFrames(rgb=rgb, depth=depth), max_share)


def test_images_that_all_differ_are_kept(make_record):
    verdict = check(make_record(frames=10, step_m=0.05))
    assert verdict.measured == {"repeated_colour_share": 0.0, "repeated_depth_share": 0.0}


@pytest.mark.parametrize("kind", ["rgb", "depth"])
def test_copies_are_found_wherever_they_stand_and_files_as_well_as_pixels(make_record, kind):
    images = {"rgb": RGB, "depth": DEPTH}[kind]
    wrong = (*images[:8], images[2], images[9])
    verdict = check(make_record(frames=10, step_m=0.05), **{kind: wrong})
    assert verdict.reason is Reason.FRAME_REPEATED
    assert (verdict.measured["frame"], verdict.measured["copy_of"]) == (8, 2)
    assert check(make_record(frames=10, step_m=0.05), **{kind: wrong}, max_share=0.1).keep  # one of ten


def test_a_camera_that_stands_still_may_show_the_same_again(make_record):
    record = make_record(frames=10, step_m=0.05)
    poses = record.T_world_camera.copy()
    poses[5:] = poses[5]
    still = (*RGB[:5], *RGB[5:6] * 5)
    assert not check(record, rgb=still).keep
    assert check(dataclasses.replace(record, T_world_camera=poses), rgb=still).keep


def test_frames_without_depth_are_no_copies_of_one_another(make_record):
    assert check(make_record(frames=10, step_m=0.05), depth=(None,) * 10).keep
