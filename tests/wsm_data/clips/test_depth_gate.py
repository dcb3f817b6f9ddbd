"""Depth against poses, in a few frames of an analytic room."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import DATASET, METRES_PER_UNIT, PILLAR, Drive, Room, along_x, encoded, frames_of, raw_depth, record_of

from wsm_data.checks.gate import require_kept
from wsm_data.clips.depth_gate import MAX_PAIRS, SPACING_M, agreeing_records, check_samples, sample_depth, spread_pairs
from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import T_OPENGL_OPENCV
from wsm_data.geometry.transform import invert
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.source.check_limits import CheckLimits

DRIVE = along_x()
BACKWARDS = np.diag([-1.0, 1.0, -1.0, 1.0])
FRAMES = frames_of(DRIVE)


def require_agreement(record, frames, dataset):
    require_kept(check_samples(record, sample_depth(record, frames, dataset), dataset))


def with_depth(frames, **pngs):
    depth = list(frames.depth)
    for name, png in pngs.items():
        depth[int(name.removeprefix("frame_"))] = png
    return replace(frames, depth=tuple(depth))


def pairs_of(drive, every=1):
    return spread_pairs(record_of(drive), range(0, len(drive.xy_m), every))


def refusal(record, frames=FRAMES, dataset=DATASET):
    with pytest.raises(DataError) as caught:
        require_agreement(record, frames, dataset)
    return caught.value


def test_depth_that_fits_its_poses_is_let_through():
    require_agreement(record_of(DRIVE), FRAMES, DATASET)


def test_how_far_depth_may_err_is_the_manifests():
    """Frames 2 and 6 of the pairs 0-2, 2-4, 4-6 tell of distances that are 4 % too long."""
    raw = raw_depth(DRIVE)
    raw[[2, 6]] = np.rint(raw[[2, 6]] * 1.04)
    frames = replace(FRAMES, depth=tuple(encoded(".png", image) for image in raw))
    assert refusal(record_of(DRIVE), frames).reason is Reason.POSE_DEPTH_DISAGREE
    noisy = replace(DATASET, checks=CheckLimits(max_depth_error=0.1))
    require_agreement(record_of(DRIVE), frames, noisy)


def test_frames_without_depth_are_left_out_of_the_pairs():
    wrong = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ T_OPENGL_OPENCV)
    assert refusal(wrong, with_depth(FRAMES, frame_2=None, frame_4=None)).reason is Reason.POSE_DEPTH_DISAGREE
    require_agreement(wrong, replace(FRAMES, depth=(None,) * len(FRAMES.rgb)), DATASET)


def test_poses_that_were_stored_in_other_axes_are_refused_and_the_fitting_ones_named():
    """Stored in OpenCV axes, read by a manifest that says OpenGL."""
    wrong = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ T_OPENGL_OPENCV)
    error = refusal(wrong)
    assert error.reason is Reason.POSE_DEPTH_DISAGREE
    assert error.details["fits"] == "opencv"
    assert "box_d435i/hall/000000" in error.message
    assert "they would agree if the poses were opencv" in error.message


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
    require_agreement(record_of(DRIVE), frames, DATASET)
    as_depth = replace(DATASET, depth=replace(DATASET.depth, invalid_codes=(0,)))
    assert refusal(record_of(DRIVE), frames, as_depth).reason is Reason.POSE_DEPTH_DISAGREE


def test_a_compared_frame_that_does_not_decode_is_refused_and_named_and_the_others_are_not_looked_at():
    assert pairs_of(DRIVE) == [(0, 2), (2, 4), (4, 6)]
    error = refusal(record_of(DRIVE), with_depth(FRAMES, frame_4=b"no png"))
    assert error.reason is Reason.FRAME_UNDECODABLE
    assert "box_d435i/hall/000000, depth frame 4" in error.message
    require_agreement(record_of(DRIVE), with_depth(FRAMES, frame_3=b"no png"), DATASET)


@pytest.mark.parametrize("step_m", [0.02, 0.07, 0.3, 0.9])
@pytest.mark.parametrize("every", [1, 3])
def test_pairs_are_spread_from_the_first_frame_to_the_last_and_lie_half_a_metre_apart(step_m, every):
    drive = along_x(frames=151, step_m=step_m, turn_rad=0.0)
    pairs = pairs_of(drive, every)
    assert len(pairs) == MAX_PAIRS if step_m > 0.03 else 5 <= len(pairs) <= MAX_PAIRS
    assert (pairs[0][0], pairs[-1][1]) == (0, 150)
    for a, b in pairs:
        assert SPACING_M - 1e-6 <= (b - a) * step_m < SPACING_M + 2 * every * step_m
    gaps = np.diff([a for a, _ in pairs])
    assert np.ptp(gaps) <= max(every, 1)


def test_a_turn_is_way_too():
    turning = Drive(xy_m=np.full((40, 2), 1.5), yaw_rad=0.1 * np.arange(40))
    assert {b - a for a, b in pairs_of(turning)} <= {5, 6}  # 0.1 rad a frame
    assert len(pairs_of(turning)) == MAX_PAIRS
    require_agreement(record_of(turning), frames_of(turning), DATASET)


def test_a_way_shorter_than_a_pair_is_one_and_a_camera_that_stands_still_none():
    assert pairs_of(along_x(frames=5, step_m=0.02)) == [(0, 4)]
    still = Drive(xy_m=np.full((6, 2), 1.5), yaw_rad=np.zeros(6))
    require_agreement(record_of(still), frames_of(still), DATASET)


def test_what_goes_wrong_late_is_found_too():
    """Twelve metres of a hall: poses and images part after ten."""
    hall = Room(high=(16.0, 3.0, 2.5), boxes=(PILLAR, ((14.0, 1.5, 0.0), (14.4, 1.9, 1.0))))
    drive = along_x(room=hall, frames=49, turn_rad=0.0)
    poses = drive.T_world_camera
    poses[40:, 1, 3] += 0.08 * np.arange(9)
    require_agreement(record_of(drive), frames_of(drive), DATASET)
    assert refusal(record_of(drive, T_world_camera=poses), frames_of(drive)).reason is Reason.POSE_DEPTH_DISAGREE


# before depth is fused


def test_of_the_trajectories_of_a_scene_those_agree_whose_samples_do():
    right = record_of(DRIVE)
    wrong = replace(right, id=EpisodeId("box_d435i", "hall", "000001"), T_world_camera=DRIVE.T_world_camera @ BACKWARDS)
    samples = {record.id.text: tuple(enumerate(FRAMES.depth))[::2] for record in (right, wrong)}
    assert agreeing_records([wrong, right], samples, DATASET) == [right]


def test_samples_that_do_not_decode_and_trajectories_without_samples_tell_nothing():
    record = record_of(DRIVE)
    assert agreeing_records([record], {}, DATASET) == [record]
    damaged = tuple((number, b"no png") for number in range(7))
    assert agreeing_records([record], {record.id.text: damaged}, DATASET) == [record]


def test_poses_are_held_against_the_samples_that_do_decode():
    wrong = record_of(DRIVE, T_world_camera=DRIVE.T_world_camera @ BACKWARDS)
    samples = ((0, b"no png"), *tuple(enumerate(FRAMES.depth))[1:])
    assert agreeing_records([wrong], {wrong.id.text: samples}, DATASET) == []
