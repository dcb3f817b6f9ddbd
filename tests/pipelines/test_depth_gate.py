"""Depth against poses, in a few frames of an analytic room."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, METRES_PER_UNIT, Drive, along_x, encoded, frames_of, raw_depth, record_of

from pipelines.depth_gate import MAX_FRAMES, SPACING_M, require_depth_agreement, spaced_frames
from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import T_OPENGL_OPENCV
from wsm_data.geometry.transform import invert

DRIVE = along_x()
FRAMES = frames_of(DRIVE)


def with_depth(frames, **pngs):
    depth = list(frames.depth)
    for name, png in pngs.items():
        depth[int(name.removeprefix("frame_"))] = png
    return replace(frames, depth=tuple(depth))


def refusal(record, frames=FRAMES, dataset=DATASET):
    with pytest.raises(DataError) as caught:
        require_depth_agreement(record, frames, dataset)
    return caught.value


def test_depth_that_fits_its_poses_is_let_through():
    require_depth_agreement(record_of(DRIVE), FRAMES, DATASET)


def test_poses_that_were_stored_in_other_axes_are_refused_and_the_fitting_ones_named():
    """Stored in OpenCV axes, read by a manifest that says OpenGL."""
    wrong = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ T_OPENGL_OPENCV)
    error = refusal(wrong)
    assert error.reason is Reason.POSE_DEPTH_DISAGREE
    assert error.details["fits"] == "opencv"
    assert "box_d435i/hall/000000" in error.message
    assert "stored as opencv they would agree" in error.message


def test_poses_that_map_the_world_to_the_camera_are_refused_and_named_as_such():
    stored = invert(DRIVE.T_world_camera @ T_OPENGL_OPENCV)
    error = refusal(record_of(DRIVE, T_world_camera=stored @ T_OPENGL_OPENCV))
    assert error.details["fits"] == "world to camera, opengl"


def test_depth_of_another_drive_is_refused_and_nothing_fits():
    elsewhere = Drive(xy_m=DRIVE.xy_m[::-1] + np.array([0.3, 0.9]), yaw_rad=DRIVE.yaw_rad + 2.0)
    error = refusal(record_of(DRIVE), frames_of(elsewhere))
    assert (error.reason, error.details["fits"]) == (Reason.POSE_DEPTH_DISAGREE, None)


def test_a_wrong_depth_scale_is_refused():
    wrong = replace(DATASET, depth=replace(DATASET.depth, metres_per_unit=2 * METRES_PER_UNIT))
    assert refusal(record_of(DRIVE), dataset=wrong).reason is Reason.POSE_DEPTH_DISAGREE


def test_codes_that_mean_no_measurement_are_not_taken_for_depth():
    """Two thirds of every image say 65535: at face value that is 6.6 m, behind every wall, and would be refused."""
    raw = raw_depth(DRIVE)
    raw[:, :, 22:] = 65535
    frames = replace(FRAMES, depth=tuple(encoded(".png", image) for image in raw))
    require_depth_agreement(record_of(DRIVE), frames, DATASET)
    as_depth = replace(DATASET, depth=replace(DATASET.depth, invalid_codes=(0,)))
    assert refusal(record_of(DRIVE), frames, as_depth).reason is Reason.POSE_DEPTH_DISAGREE


def test_a_compared_frame_that_does_not_decode_is_refused_and_named_and_the_others_are_not_looked_at():
    assert spaced_frames(record_of(DRIVE)) == (0, 2, 4, 6)
    error = refusal(record_of(DRIVE), with_depth(FRAMES, frame_4=b"no png"))
    assert error.reason is Reason.FRAME_UNDECODABLE
    assert "box_d435i/hall/000000, depth frame 4" in error.message
    require_depth_agreement(record_of(DRIVE), with_depth(FRAMES, frame_3=b"no png"), DATASET)


@pytest.mark.parametrize("step_m", [0.02, 0.07, 0.3, 0.9])
def test_compared_frames_lie_half_a_metre_apart_along_the_path(step_m):
    record = record_of(along_x(frames=40, step_m=step_m))
    frames = spaced_frames(record)
    travelled_m = step_m * np.arange(40)
    wanted_m = SPACING_M * np.arange(MAX_FRAMES)
    first_beyond = [int((travelled_m >= one - 1e-9).argmax()) for one in wanted_m if one <= travelled_m[-1]]
    assert frames == tuple(sorted(set(first_beyond)))
    assert frames[0] == 0
    assert len(frames) <= MAX_FRAMES


def test_the_way_counts_and_not_the_distance_between_its_ends():
    angle = np.linspace(0, 2 * np.pi, 60)
    circle = Drive(xy_m=2.0 + 0.4 * np.stack([np.cos(angle), np.sin(angle)], axis=1), yaw_rad=angle)
    assert len(spaced_frames(record_of(circle))) == 1 + int(2 * np.pi * 0.4 / SPACING_M)


def test_a_camera_that_turns_on_the_spot_is_compared_with_nothing_and_kept():
    turning = Drive(xy_m=np.full((6, 2), 1.5), yaw_rad=0.2 * np.arange(6))
    assert spaced_frames(record_of(turning)) == (0,)
    require_depth_agreement(record_of(turning), frames_of(turning), DATASET)
