import dataclasses

import numpy as np
import pytest

from wsm_data.checks.images.frames_repeat import check_frames_repeat
from wsm_data.errors import Reason
from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.synth.writers.images import encode_png_16

INTRINSICS = Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60)
STORED = DepthEncoding(metres_per_unit=1e-3, invalid_codes=(0,))
RGB = tuple(f"colour {t}".encode() for t in range(10))
DEPTH = tuple(np.full((60, 80), 1000 + t, np.uint16) for t in range(10))


def check(record, rgb=RGB, depth=DEPTH, max_share=0.0):
    record = dataclasses.replace(record, intrinsics=INTRINSICS)
    return check_frames_repeat(record, EpisodeFrames(rgb=rgb, depth=depth), STORED, max_share)


def floor_depth(record, wall_m=np.inf):
    """A floor without end as frame 0 sees it, and a wall across at x = `wall_m`; codes of 1 mm up to 65 m."""
    T = record.T_world_camera[0]
    rays = pixel_rays(INTRINSICS) @ T[:3, :3].T
    with np.errstate(divide="ignore"):
        floor_m = np.where(rays[..., 2] < 0, -T[2, 3] / rays[..., 2], np.inf)
        ahead_m = np.minimum(floor_m, np.where(rays[..., 0] > 0, (wall_m - T[0, 3]) / rays[..., 0], np.inf))
    return np.where(ahead_m < 65, np.rint(ahead_m * 1000), 0).astype(np.uint16)


def test_images_that_all_differ_are_kept(make_record):
    verdict = check(make_record(frames=10, step_m=0.05))
    assert verdict.measured == {"repeated_colour_share": 0.0, "repeated_depth_share": 0.0, "longest_run": 1}


@pytest.mark.parametrize("kind", ["rgb", "depth"])
def test_copies_are_found_wherever_they_stand_and_files_as_well_as_pixels(make_record, kind):
    images = {"rgb": RGB, "depth": DEPTH}[kind]
    wrong = (*images[:8], images[2], images[9])
    verdict = check(make_record(frames=10, step_m=0.05), **{kind: wrong})
    assert verdict.reason is Reason.FRAME_REPEATED
    assert (verdict.measured["frame"], verdict.measured["copy_of"]) == (8, 2)
    assert check(make_record(frames=10, step_m=0.05), **{kind: wrong}, max_share=0.1).keep  # one of ten


@pytest.mark.parametrize(("again", "kept"), [(1, True), (2, True), (3, False)])
def test_a_sensor_that_falls_behind_is_told_from_one_that_is_stuck(make_record, again, kept):
    """Of 100 images one is shown again once to three times: within the share of 5 %, but not for long."""
    shown = tuple(f"colour {t}".encode() for t in range(100))
    stuck = (*shown[:40], *shown[39:40] * again, *shown[40 + again :])
    verdict = check(make_record(frames=100, step_m=0.05, turn_deg=0.1), rgb=stuck, depth=(None,) * 100, max_share=0.05)
    assert (verdict.keep, verdict.measured["longest_run"]) == (kept, 1 + again)
    assert verdict.measured["repeated_colour_share"] == again / 100


def test_a_run_of_images_counts_from_its_first_however_slow_the_camera_is(make_record):
    """At 1.1 cm a frame no two neighbours are 2 cm apart: of ten alike, eight are farther than that from the first."""
    record = make_record(frames=30, step_m=0.011, turn_deg=0.0)
    frozen = (*(f"colour {t}".encode() for t in range(20)), *[b"colour 19"] * 10)
    verdict = check(record, rgb=frozen, depth=(None,) * 30, max_share=0.5)
    assert (verdict.reason, verdict.measured["frame"], verdict.measured["copy_of"]) == (Reason.FRAME_REPEATED, 21, 19)


def test_a_camera_that_stands_still_may_show_the_same_again(make_record):
    record = make_record(frames=10, step_m=0.05)
    poses = record.T_world_camera.copy()
    poses[5:] = poses[5]
    still = (*RGB[:5], *RGB[5:6] * 5)
    assert not check(record, rgb=still).keep
    assert check(dataclasses.replace(record, T_world_camera=poses), rgb=still).keep


def test_frames_without_depth_are_no_copies_of_one_another(make_record):
    assert check(make_record(frames=10, step_m=0.05), depth=(None,) * 10).keep


def test_depth_that_the_motion_leaves_as_it_is_may_repeat_and_colour_may_not(make_record):
    """A camera 0.5 m over a floor without end, pitched by 10 degrees, sees it the same from everywhere."""
    record = make_record(frames=10, step_m=0.05)
    floor = floor_depth(record)
    for image in (floor, encode_png_16(floor, 1)):  # as pixels, and as a file
        assert check(record, depth=(image,) * 10).measured["repeated_depth_share"] == 0.0
    assert check(record, rgb=RGB[:1] * 10, depth=(floor,) * 10).reason is Reason.FRAME_REPEATED


def test_depth_that_repeats_where_one_wall_must_come_nearer_is_a_copy(make_record):
    record = make_record(frames=10, step_m=0.05)
    verdict = check(record, depth=(floor_depth(record, wall_m=3.0),) * 10)
    assert verdict.reason is Reason.FRAME_REPEATED
    assert verdict.measured["repeated_depth_share"] == 0.9  # 9 of 10: by 0.05 m at 3 m they err by 1.7 %


def test_depth_without_measurements_does_not_excuse_its_copies(make_record):
    assert not check(make_record(frames=10, step_m=0.05), depth=(np.zeros((60, 80), np.uint16),) * 10).keep
