"""The scene is a room of 8 x 6 x 3 m with a box in it, whose depth is known in closed form."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from wsm_data.checks.depth_agreement import check_depth_agreement
from wsm_data.errors import Reason
from wsm_data.geometry.camera import T_OPENGL_OPENCV, pixel_rays
from wsm_data.geometry.transform import invert
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.source.check_limits import CheckLimits

INTRINSICS = Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60)
ROOM = np.array([[-2.0, -2.0, 0.0], [6.0, 4.0, 3.0]])
BOX = np.array([[2.5, 0.8, 0.0], [3.0, 1.6, 0.7]])
FRAMES = (0, 8, 16, 24, 32)


def box_depth(T_world_camera, box, inside):
    """Depth along the optical axis to an axis-aligned box, seen from within or from outside (slab method)."""
    rays = pixel_rays(INTRINSICS) @ T_world_camera[:3, :3].T
    with np.errstate(divide="ignore"):
        a, b = ((corner - T_world_camera[:3, 3]) / rays for corner in box)
    near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
    return far if inside else np.where((near > 0) & (near < far), near, np.inf)


def depth_of(T_world_camera):
    depth = np.minimum(box_depth(T_world_camera, ROOM, True), box_depth(T_world_camera, BOX, False))
    return np.round(depth, 4).astype(np.float32)  # stored in 0.1 mm


def check(record, depth_m, camera_axes="opengl"):
    return check_depth_agreement(
        record, depth_m, list(pairwise(sorted(depth_m))), camera_axes, CheckLimits().max_depth_error
    )


def corridor_depth(T_world_camera):
    """A corridor of 40 m with a door frame in it: nearly all that is seen looks the same along it."""
    depth = box_depth(T_world_camera, np.array([[-20.0, -1.0, 0.0], [20.0, 1.2, 2.5]]), True)
    frame = box_depth(T_world_camera, np.array([[7.0, 0.75, 0.0], [7.3, 1.2, 2.5]]), False)
    return np.round(np.minimum(depth, frame), 4).astype(np.float32)


@pytest.fixture
def scene(make_record):
    record = make_record(frames=40, intrinsics=INTRINSICS)
    return record, {frame: depth_of(record.T_world_camera[frame]) for frame in FRAMES}


def test_exact_depth_agrees_to_its_rounding(scene):
    record, depth_m = scene
    verdict = check(record, depth_m)
    assert verdict.keep
    assert verdict.measured["pairs"] == 4
    assert verdict.measured["median_relative_error"] < 1e-4  # 0.1 mm steps at 1 to 6 m


@pytest.mark.parametrize(("declared", "actual"), [("opengl", "opencv"), ("opencv", "opengl")])
def test_wrong_camera_axes_are_refused_and_the_right_ones_named(scene, declared, actual):
    """The manifest says `declared`, so the reader turned poses that were stored as `actual`."""
    record, depth_m = scene
    wrong = dataclasses.replace(record, T_world_camera=record.T_world_camera @ T_OPENGL_OPENCV)
    verdict = check(wrong, depth_m, declared)
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] == actual
    assert verdict.measured["median_relative_error"] > 0.1
    assert actual in verdict.message


def test_poses_stored_the_other_way_round_are_named(scene):
    record, depth_m = scene
    stored = invert(record.T_world_camera @ T_OPENGL_OPENCV)  # world to an OpenGL camera
    wrong = dataclasses.replace(record, T_world_camera=stored @ T_OPENGL_OPENCV)
    assert check(wrong, depth_m).measured["fits"] == "world to camera, opengl"


def test_poses_of_another_trajectory_fit_no_convention(scene, make_record):
    _, depth_m = scene
    other = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.02, turn_deg=-3.0)
    verdict = check(other, depth_m)
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] is None


def test_depth_in_the_wrong_unit_is_refused(scene):
    """A scale of 1000 where 10000 is right: the motion no longer fits the depth."""
    record, depth_m = scene
    assert not check(record, {t: 10 * depth for t, depth in depth_m.items()}).keep


def test_pixels_without_measurement_do_not_count(scene):
    record, depth_m = scene
    holes = {frame: depth.copy() for frame, depth in depth_m.items()}
    for depth in holes.values():
        depth[:, ::3] = 0
        depth[40:] = 0
    verdict = check(record, holes)
    assert verdict.keep
    assert verdict.measured["median_relative_error"] < 1e-4


def test_a_camera_that_stands_still_tells_nothing(make_record):
    record = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.0, turn_deg=0.0)
    depth_m = {frame: depth_of(record.T_world_camera[frame]) for frame in FRAMES}
    verdict = check(record, depth_m)
    assert verdict.keep
    assert verdict.measured["pairs"] == 0


def looking_backwards(record):
    return dataclasses.replace(record, T_world_camera=record.T_world_camera @ np.diag([-1.0, 1.0, -1.0, 1.0]))


def test_a_camera_that_looks_backwards_is_refused_and_named(scene):
    record, depth_m = scene
    verdict = check(looking_backwards(record), depth_m)
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] == "opengl, turned by 180 degrees of yaw"


def test_in_a_corridor_what_stands_in_it_tells_which_way_the_camera_moved(make_record):
    """The median over all points is below 1e-3 here, whichever way the camera moved."""
    record = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.05, turn_deg=0.0, pitch_deg=0.0)
    depth_m = {frame: corridor_depth(record.T_world_camera[frame]) for frame in FRAMES}
    right, wrong = check(record, depth_m), check(looking_backwards(record), depth_m)
    assert right.keep
    assert right.measured["pairs"] >= 1
    assert wrong.reason is Reason.POSE_DEPTH_DISAGREE
    assert wrong.measured["median_relative_error"] > 0.05


def test_an_endless_corridor_seen_straight_ahead_tells_nothing(make_record):
    record = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.05, turn_deg=0.0, pitch_deg=0.0)
    endless = np.array([[-2000.0, -1.0, 0.0], [2000.0, 1.2, 2.5]])
    depth_m = {frame: box_depth(record.T_world_camera[frame], endless, True).astype(np.float32) for frame in FRAMES}
    for one in (record, looking_backwards(record)):
        verdict = check(one, depth_m)
        assert (verdict.keep, verdict.measured["pairs"]) == (True, 0)


@pytest.mark.parametrize("scale", [5.0, 10.0, 1000.0, 0.2])
def test_depth_in_another_unit_is_refused_as_that(scene, scale):
    record, depth_m = scene
    verdict = check(record, {frame: (depth * scale).astype(np.float32) for frame, depth in depth_m.items()})
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] == f"depth were divided by {scale:g}"
    assert verdict.message.endswith("correct depth.metres_per_unit of the manifest")


@pytest.mark.parametrize("share", [0.005, 0.01, 0.02])
def test_noisy_depth_is_not_taken_for_another_meaning_of_the_poses(scene, share):
    record, depth_m = scene
    noise = np.random.default_rng(0)
    noisy = {
        t: (depth * (1 + share * noise.normal(size=depth.shape))).astype(np.float32) for t, depth in depth_m.items()
    }
    assert check(record, noisy).keep


def test_frames_that_see_nothing_in_common_tell_nothing(make_record):
    record = make_record(frames=3, intrinsics=INTRINSICS, turn_deg=120.0)
    depth_m = {frame: depth_of(record.T_world_camera[frame]) for frame in range(3)}
    assert check(record, depth_m).measured["pairs"] == 0


@pytest.mark.parametrize("frames", [(), (5,)])
def test_fewer_than_two_frames_tell_nothing(scene, frames):
    record, depth_m = scene
    assert check(record, dict.fromkeys(frames, depth_m[0])).keep
