"""Poses that stand still, or jump, while a camera drives towards a wall 4 m away."""

import dataclasses

import numpy as np
import pytest

from wsm_data.checks.depth_motion import check_depth_motion
from wsm_data.errors import Reason

STEPS = [(0, 10), (10, 20), (20, 30), (30, 39)]


@pytest.fixture
def record(make_record):
    return make_record(frames=40, step_m=0.05, turn_deg=0.0, pitch_deg=0.0)


def wall_m(x_m):
    """Depth of a wall at x = 4 m that is met head on."""
    return np.full((270, 480), 4.0 - x_m, np.float32)


def check(record, depth_at):
    depth_m = {t: wall_m(depth_at[t]) for step in STEPS for t in step}
    return check_depth_motion(record, depth_m, STEPS, 0.02)


def x_of(record):
    return record.T_world_camera[:, 0, 3]


def stuck(record, first):
    poses = record.T_world_camera.copy()
    poses[first:] = poses[first]
    return dataclasses.replace(record, T_world_camera=poses)


def test_poses_that_move_as_the_images_do_are_kept(record):
    verdict = check(record, x_of(record))
    assert verdict.keep
    assert verdict.measured["steps"] == 4
    assert verdict.measured["worst_step_error"] < 1e-6


@pytest.mark.parametrize("first", [0, 10, 20])
def test_poses_that_are_stuck_are_refused_with_the_worst_step(record, first):
    verdict = check(stuck(record, first), x_of(record))
    assert verdict.reason is Reason.POSE_MOTION_DISAGREE
    assert verdict.measured["worst_step"] == [30, 39]  # nearest the wall half a metre counts most
    # the wall comes 0.45 m nearer, and would stay where it was
    depth = 4.0 - x_of(record)
    assert verdict.measured["worst_step_error"] == pytest.approx(depth[30] / depth[39] - 1)
    assert "poses move 0.00 m" in verdict.message


def test_poses_that_move_while_the_images_stand_still_are_named_as_such(record):
    verdict = check(record, np.zeros(40))
    assert verdict.reason is Reason.POSE_MOTION_DISAGREE
    assert "the poses move where the images stand still" in verdict.message


def test_a_camera_that_stands_still_is_kept(record):
    assert check(stuck(record, 0), np.zeros(40)).keep


def past_a_post_m(record, x_m):
    """The wall, and before it a post that is 0.3 m wide and stands 2.3 m from where the camera starts."""
    K = record.intrinsics
    depth = wall_m(x_m)
    columns = np.abs(np.arange(K.width) - K.cx) <= K.fx * 0.15 / (2.3 - x_m)
    depth[:, columns] = 2.3 - x_m
    return depth


def test_what_is_hidden_behind_a_post_when_the_camera_nears_it_is_not_wrong(record):
    """Of what was seen at 0.8 m, more than a quarter is hidden at 0.35 m: it errs by several times the depth."""
    depth_m = {t: past_a_post_m(record, x_of(record)[t]) for step in STEPS for t in step}
    verdict = check_depth_motion(record, depth_m, STEPS, 0.02)
    assert verdict.measured["worst_step_error"] > 1
    assert verdict.keep
    assert check_depth_motion(stuck(record, 20), depth_m, STEPS, 0.02).reason is Reason.POSE_MOTION_DISAGREE


def test_one_step_alone_is_refused_from_twice_the_limit_on(record):
    """A jump of the images by 0.3 m or 0.9 m: a tenth and two fifths of the depth after it."""
    for jump_m, kept in ((0.3, True), (0.9, False)):
        x = x_of(record) + np.where(np.arange(40) >= 15, jump_m, 0)
        depth = 4.0 - x[20]
        assert (jump_m / depth <= 0.2) == kept
        assert check(record, x).keep == kept
