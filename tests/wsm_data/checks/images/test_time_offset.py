"""The camera turns to and fro in a room, so that no two moments look the same."""

import dataclasses

import numpy as np
import pytest

from wsm_data.checks.images.time_offset import MIN_PAIRS, PairCosts, check_time_offset, is_clear, partial_offset
from wsm_data.errors import Reason
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.depth import DepthRange

INTRINSICS = Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60)
RANGE = DepthRange(max_m=10.0)
FRAMES = 60
SWAY_DEG = 10.0 * np.sin(np.arange(FRAMES + 6) / 8)


@pytest.fixture(scope="module")
def swaying(make_record, room_video):
    frames = np.arange(FRAMES + 6)
    yaw_deg = SWAY_DEG / np.maximum(frames, 1)  # `make_record` multiplies by the number of the frame
    record = make_record(frames=FRAMES + 6, intrinsics=INTRINSICS, step_m=0.03, turn_deg=yaw_deg)
    return record, room_video(record.T_world_camera, INTRINSICS)


def cut(record, numbers):
    names = record.rgb_members[: len(numbers)]
    return dataclasses.replace(
        record, T_world_camera=record.T_world_camera[numbers], rgb_members=names, depth_members=names
    )


def jittering(record, rng):
    """Poses off by 1 cm and 0.5 degrees of yaw."""
    T = record.T_world_camera.copy()
    for one in T:
        angle = np.deg2rad(0.5) * rng.normal()
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        one[:3, :3] = turn @ one[:3, :3]
        one[:3, 3] += 0.01 / np.sqrt(3) * rng.normal(size=3)
    return dataclasses.replace(record, T_world_camera=T)


def test_poses_in_step_are_kept_and_no_offset_gains(swaying):
    record, video = swaying
    verdict = check_time_offset(record, video, RANGE)
    assert verdict.keep
    assert verdict.measured["offset_gain"] < 0
    assert verdict.measured["motion_change_over_jitter"] > 1


@pytest.mark.parametrize("offset", [-3, -2, -1, 1, 2, 3])
def test_poses_out_of_step_are_refused_and_the_offset_named(swaying, offset):
    record, video = swaying
    late = cut(record, np.arange(3 + offset, 3 + offset + FRAMES))
    verdict = check_time_offset(late, video[3 : 3 + FRAMES], RANGE)
    assert verdict.reason is Reason.POSE_OUT_OF_STEP
    assert (verdict.measured["offset_frames"], verdict.measured["first_frame"]) == (-offset, 0)
    frames, side = "1 frame" if abs(offset) == 1 else f"{abs(offset)} frames", "earlier" if offset > 0 else "later"
    assert f"it fits those of {frames} {side} better" in verdict.message


def test_a_frame_that_was_dropped_is_found_where_it_is_missing(swaying):
    record, video = swaying
    kept = np.delete(np.arange(FRAMES), 30)
    verdict = check_time_offset(cut(record, np.arange(FRAMES - 1)), video[kept], RANGE)
    assert verdict.reason is Reason.POSE_OUT_OF_STEP
    assert verdict.measured["offset_frames"] == 1
    assert abs(verdict.measured["first_frame"] - 30) <= 2  # within the frames that look alike
    assert "in frames 2" in verdict.message or "in frames 3" in verdict.message


@pytest.mark.parametrize(("told", "shape"), [(True, "edge"), (False, "hill")])
def test_a_slip_begins_and_ends_from_one_pair_to_the_next(told, shape):
    """Pairs of 6 frames, one a frame; from frame 30 on another pose suits those across it, or their neighbours too."""
    first = np.arange(3, 53)
    across = (first < 30) & (first + 6 >= 30)
    hill = np.clip(1 - np.abs(first - 26.5) / 20, 0, 1)
    costs = np.full((len(first), 19), 0.5)
    costs[:, 7] = np.where(across, 0.2, 0.8) if shape == "edge" else 0.5 - 0.3 * hill
    pairs = PairCosts(first=first, lag=6, change=0.0, costs=costs)
    offset = partial_offset(pairs, 60)
    assert offset.votes == 1.0
    assert offset.gain >= 0.3
    assert is_clear(offset, pairs) is told
    if told:
        assert (offset.start, offset.stop) == (30, 60)
        assert offset.contrast == pytest.approx(0.6)


def test_a_slip_is_told_under_jitter_and_jitter_is_no_slip(swaying, room_video):
    record, _ = swaying
    video = room_video(record.T_world_camera, INTRINSICS, noise=0.01)
    noisy = jittering(record, np.random.default_rng(3))
    assert check_time_offset(noisy, video, RANGE).keep
    verdict = check_time_offset(cut(noisy, np.arange(1, FRAMES)), video[: FRAMES - 1], RANGE)
    assert verdict.measured["offset_frames"] == -1


def test_straight_ahead_at_constant_speed_no_offset_is_told(make_record, room_video):
    """All of the motions are the same, and what jitter leaves of a difference is not taken for one."""
    record = make_record(frames=FRAMES, intrinsics=INTRINSICS, step_m=0.03, turn_deg=0.0)
    video = room_video(record.T_world_camera, INTRINSICS)
    for poses in (record, jittering(record, np.random.default_rng(0))):
        verdict = check_time_offset(cut(poses, np.arange(1, FRAMES)), video[: FRAMES - 1], RANGE)
        assert verdict.keep
        assert verdict.measured["motion_change_over_jitter"] < 0.75


def test_a_minority_of_points_decides_nothing(swaying):
    """A fifth of every image moves with the camera, as a hand before it would."""
    record, video = swaying
    covered = video.copy()
    covered[:, :, :16] = -0.5
    assert check_time_offset(record, covered, RANGE).keep


def test_short_and_still_trajectories_tell_nothing(make_record, room_video):
    for frames, step_m in ((8, 0.05), (40, 0.0)):
        record = make_record(frames=frames, intrinsics=INTRINSICS, step_m=step_m, turn_deg=0.0)
        verdict = check_time_offset(record, room_video(record.T_world_camera, INTRINSICS), RANGE)
        assert verdict.keep
    empty = np.ones((40, 60, 80), np.float32)
    assert (
        check_time_offset(make_record(frames=40, intrinsics=INTRINSICS), empty, RANGE).measured["offset_pairs"]
        < MIN_PAIRS
    )
