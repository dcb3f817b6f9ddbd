"""The scene is a room of 8 x 6 x 3 m with a box in it, whose depth is known in closed form."""

import dataclasses

import numpy as np
import pytest

from wsm_data.checks.depth_agreement import DepthAgreementConfig, check_depth_agreement
from wsm_data.errors import Reason
from wsm_data.geometry.camera import T_OPENGL_OPENCV, pixel_rays
from wsm_data.geometry.transform import invert
from wsm_data.schema.camera import Intrinsics

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


@pytest.fixture
def scene(make_record):
    record = make_record(frames=40, intrinsics=INTRINSICS)
    return record, {frame: depth_of(record.T_world_camera[frame]) for frame in FRAMES}


def test_exact_depth_agrees_to_its_rounding(scene):
    record, depth_m = scene
    verdict = check_depth_agreement(record, depth_m, "opengl")
    assert verdict.keep
    assert verdict.measured["pairs"] == 4
    assert verdict.measured["median_relative_error"] < 1e-4  # 0.1 mm steps at 1 to 6 m


@pytest.mark.parametrize(("declared", "actual"), [("opengl", "opencv"), ("opencv", "opengl")])
def test_wrong_camera_axes_are_refused_and_the_right_ones_named(scene, declared, actual):
    """The manifest says `declared`, so the reader turned poses that were stored as `actual`."""
    record, depth_m = scene
    wrong = dataclasses.replace(record, T_world_camera=record.T_world_camera @ T_OPENGL_OPENCV)
    verdict = check_depth_agreement(wrong, depth_m, declared)
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] == actual
    assert verdict.measured["median_relative_error"] > 0.1
    assert actual in verdict.message


def test_poses_stored_the_other_way_round_are_named(scene):
    record, depth_m = scene
    stored = invert(record.T_world_camera @ T_OPENGL_OPENCV)  # world to an OpenGL camera
    wrong = dataclasses.replace(record, T_world_camera=stored @ T_OPENGL_OPENCV)
    assert check_depth_agreement(wrong, depth_m, "opengl").measured["fits"] == "world to camera, opengl"


def test_poses_of_another_trajectory_fit_no_convention(scene, make_record):
    _, depth_m = scene
    other = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.02, turn_deg=-3.0)
    verdict = check_depth_agreement(other, depth_m, "opengl")
    assert verdict.reason is Reason.POSE_DEPTH_DISAGREE
    assert verdict.measured["fits"] is None


def test_depth_in_the_wrong_unit_is_refused(scene):
    """A scale of 1000 where 10000 is right: the motion no longer fits the depth."""
    record, depth_m = scene
    assert not check_depth_agreement(record, {t: 10 * depth for t, depth in depth_m.items()}, "opengl").keep


def test_pixels_without_measurement_do_not_count(scene):
    record, depth_m = scene
    holes = {frame: depth.copy() for frame, depth in depth_m.items()}
    for depth in holes.values():
        depth[:, ::3] = 0
        depth[40:] = 0
    verdict = check_depth_agreement(record, holes, "opengl", DepthAgreementConfig(pixel_stride=1))
    assert verdict.keep
    assert verdict.measured["median_relative_error"] < 1e-4


def test_a_camera_that_stands_still_tells_nothing(make_record):
    record = make_record(frames=40, intrinsics=INTRINSICS, step_m=0.0, turn_deg=0.0)
    depth_m = {frame: depth_of(record.T_world_camera[frame]) for frame in FRAMES}
    verdict = check_depth_agreement(record, depth_m, "opengl")
    assert verdict.keep
    assert verdict.measured["pairs"] == 0


def test_frames_that_see_nothing_in_common_tell_nothing(make_record):
    record = make_record(frames=3, intrinsics=INTRINSICS, turn_deg=120.0)
    depth_m = {frame: depth_of(record.T_world_camera[frame]) for frame in range(3)}
    assert check_depth_agreement(record, depth_m, "opengl").measured["pairs"] == 0


@pytest.mark.parametrize("frames", [(), (5,)])
def test_fewer_than_two_frames_tell_nothing(scene, frames):
    record, depth_m = scene
    assert check_depth_agreement(record, dict.fromkeys(frames, depth_m[0]), "opengl").keep
