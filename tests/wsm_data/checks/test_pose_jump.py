import numpy as np
import pytest

from wsm_data.checks.pose_jump import check_pose_jump
from wsm_data.errors import Reason
from wsm_data.schema.source.check_limits import CheckLimits

LIMITS = CheckLimits()


def changed(make_record, frame, T):
    record = make_record()
    poses = np.array(record.T_world_camera)
    poses[frame:] = T @ poses[frame:]
    return make_record(T_world_camera=poses)


def moved(metres):
    T = np.eye(4)
    T[0, 3] = metres
    return T


def test_a_smooth_drive_is_kept_with_its_numbers(make_record):
    verdict = check_pose_jump(make_record(step_m=0.06, turn_deg=1.5), LIMITS)
    assert verdict.keep
    assert verdict.measured["max_step_m"] == pytest.approx(0.06)  # as built
    assert verdict.measured["max_turn_deg"] == pytest.approx(1.5, rel=0.02)  # yaw by 1.5 degrees, pitched by 10


@pytest.mark.parametrize("frame", [1, 20, 39])
def test_a_teleport_is_refused_and_located(make_record, frame):
    verdict = check_pose_jump(changed(make_record, frame, moved(2.0)), LIMITS)
    assert verdict.reason is Reason.POSE_JUMP
    assert verdict.measured["frame"] == frame - 1
    assert verdict.measured["max_step_m"] == pytest.approx(2.0, abs=0.06)


def test_a_sudden_turn_is_refused(make_record):
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    record = make_record(step_m=0.0)
    poses = np.array(record.T_world_camera)
    poses[20:, :3, :3] = half_turn[:3, :3] @ poses[20:, :3, :3]
    verdict = check_pose_jump(make_record(T_world_camera=poses), LIMITS)
    assert (verdict.reason, verdict.measured["frame"]) == (Reason.POSE_JUMP, 19)


def test_large_steps_throughout_are_a_fast_drive_and_no_jump(make_record):
    assert check_pose_jump(make_record(step_m=0.7), LIMITS).keep


def test_a_jump_needs_the_floor_however_still_the_rest_is(make_record):
    assert check_pose_jump(changed(lambda **f: make_record(step_m=0.001, **f), 20, moved(0.25)), LIMITS).keep


def test_a_standing_camera_and_a_single_frame_do_not_jump(make_record):
    assert check_pose_jump(make_record(step_m=0.0, turn_deg=0.0), LIMITS).keep
    assert check_pose_jump(make_record(frames=1), LIMITS).keep


def test_limits_of_the_manifest_decide_how_far_a_step_may_lead(make_record):
    """Steps of 6 cm: 8 times that is 0.48 m."""
    step = changed(make_record, 20, moved(0.7))
    assert not check_pose_jump(step, LIMITS).keep
    assert check_pose_jump(step, CheckLimits(min_jump_m=0.8)).keep


def test_limits_of_the_manifest_decide_how_sharp_a_turn_may_be(make_record):
    """The rotation is one by asin 0.6 = 36.9 degrees; 8 times 1.5 degrees is 12."""
    poses = np.array(make_record().T_world_camera)
    poses[20:, :3, :3] = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]) @ poses[20:, :3, :3]
    turn = make_record(T_world_camera=poses)
    assert check_pose_jump(turn, LIMITS).keep
    assert not check_pose_jump(turn, CheckLimits(min_jump_deg=30.0)).keep
