import dataclasses

from wsm_data.checks.record import RECORD_CHECKS, check_record, record_refusal
from wsm_data.errors import Reason


def test_a_sound_record_passes_every_check(make_record, dataset):
    verdicts = check_record(make_record(), dataset)
    assert list(verdicts) == list(RECORD_CHECKS)
    assert all(verdict.keep and verdict.measured and verdict.limits for verdict in verdicts.values())


def test_all_faults_of_a_record_are_told_in_a_fixed_order(make_record, dataset):
    record = make_record(frames=4, height_m=3.0, step_m=0.01)
    poses = record.T_world_camera.copy()
    poses[2:, 0, 3] += 5
    wide = dataclasses.replace(record.intrinsics, fx=500.0)
    record = dataclasses.replace(record, T_world_camera=poses, intrinsics=wide)
    assert [verdict.reason for verdict in check_record(record, dataset).values()] == [
        Reason.EPISODE_TOO_SHORT,
        Reason.INTRINSICS_MISFIT,
        Reason.MOUNT_MISFIT,
        Reason.POSE_JUMP,
    ]


def test_a_refusal_stands_under_the_first_fault_and_tells_all_and_a_sound_record_has_none(make_record, dataset):
    assert record_refusal(make_record(), dataset) is None
    record = make_record(frames=4, height_m=3.0)
    refusal = record_refusal(record, dataset)
    assert (refusal.unit, refusal.source) == (record.id.text, record.container)
    assert (refusal.reason, refusal.details["frames"]) == (Reason.EPISODE_TOO_SHORT, 4)
    assert [one["reason"] for one in refusal.details["also"]] == [Reason.MOUNT_MISFIT]
    assert "camera_height_m must lie in [0.05, 2], found 3" in refusal.message
