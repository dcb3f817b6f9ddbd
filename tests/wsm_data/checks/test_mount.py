from dataclasses import replace

import numpy as np
import pytest

from wsm_data.checks.mount import check_mount
from wsm_data.errors import Reason
from wsm_data.schema.source.check_limits import CheckLimits
from wsm_data.schema.source.motion import CarriedBy, Motion


@pytest.mark.parametrize("pitch_deg", [0.0, 12.0, 30.0])
def test_a_camera_mounted_as_it_says_is_kept(make_record, dataset, pitch_deg):
    verdict = check_mount(make_record(pitch_deg=pitch_deg), dataset)
    assert verdict.keep
    assert verdict.measured["mount_pitch_deg"] == pytest.approx(pitch_deg)
    assert verdict.measured["pitch_disagreement_deg"] == pytest.approx(0, abs=1e-6)  # both built from one number
    assert verdict.measured["roll_deg"] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    "fields", [{"height_m": 2.5}, {"height_m": 0.0}, {"height_m": -0.4}, {"pitch_deg": 60.0}, {"pitch_deg": -20.0}]
)
def test_a_mount_outside_of_its_limits_is_refused(make_record, dataset, fields):
    assert check_mount(make_record(**fields), dataset).reason is Reason.MOUNT_MISFIT


def test_a_mount_that_is_not_the_cameras_is_refused(make_record, dataset):
    verdict = check_mount(make_record(pitch_deg=10, camera_pitch_rad=np.deg2rad(20)), dataset)
    assert verdict.reason is Reason.MOUNT_MISFIT
    assert verdict.measured["pitch_disagreement_deg"] == pytest.approx(10)


def test_poses_in_the_wrong_camera_axes_are_upside_down_even_when_level(make_record, dataset):
    record = make_record(pitch_deg=0.0)
    flipped = record.T_world_camera @ np.diag([1.0, -1, -1, 1])
    verdict = check_mount(make_record(pitch_deg=0.0, T_world_camera=flipped), dataset)
    assert verdict.reason is Reason.MOUNT_MISFIT
    assert verdict.measured["roll_deg"] == pytest.approx(180)
    assert verdict.measured["fits"] == "opencv"
    assert "stored as opencv and not as opengl: correct the manifest's camera_axes" in verdict.message


def test_where_other_axes_would_not_do_either_none_are_named(make_record, dataset):
    assert "camera_axes" not in check_mount(make_record(height_m=2.5), dataset).message


def test_a_hand_may_pitch_as_it_likes_but_roll_only_within_the_limit(make_record, dataset):
    held = replace(dataset, motion=Motion(carried_by=CarriedBy.HAND))
    record = make_record(pitch_deg=10, camera_pitch_rad=np.deg2rad(20))
    assert check_mount(record, held).keep
    flipped = record.T_world_camera @ np.diag([1.0, -1, -1, 1])
    assert check_mount(replace(record, T_world_camera=flipped), held).reason is Reason.MOUNT_MISFIT


def test_a_rolled_camera_is_refused_with_its_angle(make_record, dataset):
    roll = np.eye(4)
    angle = np.deg2rad(8)
    roll[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    verdict = check_mount(
        make_record(pitch_deg=0, T_world_camera=make_record(pitch_deg=0).T_world_camera @ roll), dataset
    )
    assert verdict.reason is Reason.MOUNT_MISFIT
    assert verdict.measured["roll_deg"] == pytest.approx(8)


@pytest.mark.parametrize(
    ("fields", "limits"),
    [
        ({"height_m": 0.0}, {"min_camera_height_m": 0.0}),
        ({"pitch_deg": -20.0}, {"max_pitch_up_deg": 21.0}),
        ({"pitch_deg": 10.0, "camera_pitch_rad": np.deg2rad(20)}, {"max_pitch_disagreement_deg": 11.0}),
    ],
)
def test_another_robot_has_its_limits_in_the_manifest(make_record, dataset, fields, limits):
    record = make_record(**fields)
    assert not check_mount(record, dataset).keep
    assert check_mount(record, replace(dataset, checks=CheckLimits(**limits))).keep
