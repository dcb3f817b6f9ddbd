"""Rays, projection, and camera axes. What is up in the world must be up in the image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.geometry.camera import T_OPENGL_OPENCV, T_STORED_OPENCV, pixel_rays, project, unproject
from wsm_data.geometry.transform import invert, transform_points
from wsm_data.schema.camera import Intrinsics

D435I = Intrinsics(fx=355.81, fy=351.69, cx=240.0, cy=135.0, width=480, height=270)  # as published
SMALL = Intrinsics(fx=11.0, fy=12.0, cx=6.3, cy=4.1, width=13, height=9)


def opengl_camera_looking_along_world_y(pitch_down_rad=0.0, height_m=0.5):
    """Mount of InternData-N1: a turn about x by 90 degrees less the pitch; x right, y up, z backward."""
    angle = np.pi / 2 - pitch_down_rad
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, height_m], [0, 0, 0, 1]])


def pixel_and_depth(T_world_camera, point_world):
    pixel, depth_m = project(transform_points(invert(T_world_camera), np.array(point_world)[None]), D435I)
    return pixel[0], depth_m[0]


@given(seed=st.integers(0, 2**32 - 1))
def test_projecting_what_was_unprojected_gives_every_pixel_and_its_depth(seed):
    depth_m = np.random.default_rng(seed).uniform(0.05, 20, (SMALL.height, SMALL.width))
    pixels, z_m = project(unproject(depth_m, SMALL), SMALL)
    rows, columns = np.mgrid[: SMALL.height, : SMALL.width]
    np.testing.assert_allclose(pixels[..., 0], columns, rtol=0, atol=1e-13)
    np.testing.assert_allclose(pixels[..., 1], rows, rtol=0, atol=1e-13)
    assert np.array_equal(z_m, depth_m)


@given(st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(0.1, 20)))
def test_projection_is_the_camera_matrix(point):
    homogeneous = D435I.matrix @ point
    pixel, depth_m = project(np.array(point), D435I)
    np.testing.assert_allclose(pixel, homogeneous[:2] / homogeneous[2], rtol=1e-12, atol=1e-9)
    assert depth_m == point[2]


def test_rays_have_unit_depth_and_solve_the_camera_matrix():
    rays = pixel_rays(SMALL)
    assert rays.shape == (9, 13, 3)
    assert (rays[..., 2] == 1).all()
    np.testing.assert_allclose(SMALL.matrix @ rays[7, 11], [11, 7, 1], rtol=0, atol=1e-13)


def test_the_ray_through_the_principal_point_is_the_optical_axis():
    assert pixel_rays(D435I)[135, 240].tolist() == [0, 0, 1]


def test_single_precision_depth_is_unprojected_in_double_precision():
    depth_m = np.full((SMALL.height, SMALL.width), 1.1, np.float32)
    assert unproject(depth_m, SMALL).dtype == np.float64


def test_a_point_without_depth_in_front_is_reported_by_its_depth_and_raises_nothing():
    with np.errstate(all="raise"):
        pixels, depth_m = project(np.array([[1.0, 2.0, 0.0], [1.0, 2.0, -3.0]]), D435I)
    assert depth_m.tolist() == [0, -3]
    assert np.isfinite(pixels).all()


@pytest.mark.parametrize("pitch_deg", [0, 15, 30])
@pytest.mark.parametrize(
    ("point_world", "side"),
    [((0, 3, 0.9), "upper"), ((0, 3, 0.1), "lower"), ((0.5, 3, 0.5), "right"), ((-0.5, 3, 0.5), "left")],
)
def test_what_is_up_or_left_in_the_world_is_up_or_left_in_the_image(pitch_deg, point_world, side):
    T_world_opencv = opengl_camera_looking_along_world_y(np.deg2rad(pitch_deg)) @ T_OPENGL_OPENCV
    ahead, _ = pixel_and_depth(T_world_opencv, (0, 3, 0.5))
    pixel, depth_m = pixel_and_depth(T_world_opencv, point_world)
    u, v = pixel - ahead
    assert depth_m > 0
    assert {"upper": v < 0, "lower": v > 0, "right": u > 0, "left": u < 0}[side]


def test_a_point_above_the_horizon_is_in_the_upper_half_of_a_level_image():
    T_world_opencv = opengl_camera_looking_along_world_y() @ T_OPENGL_OPENCV
    pixel, depth_m = pixel_and_depth(T_world_opencv, (0, 3, 1.5))
    assert depth_m == pytest.approx(3, abs=1e-12)
    assert pixel == pytest.approx([240, 135 - 351.69 / 3], abs=1e-9)


def test_a_camera_that_looks_down_sees_the_horizon_higher_in_the_image():
    T_world_opencv = opengl_camera_looking_along_world_y(np.deg2rad(20)) @ T_OPENGL_OPENCV
    pixel, _ = pixel_and_depth(T_world_opencv, (0, 1000, 0.5))
    assert pixel[1] == pytest.approx(135 - 351.69 * np.tan(np.deg2rad(20)), abs=1e-6)


def test_poses_stored_in_opengl_axes_and_read_as_opencv_put_the_scene_behind_the_camera():
    _, depth_m = pixel_and_depth(opengl_camera_looking_along_world_y(), (0, 3, 1.5))
    assert depth_m == pytest.approx(-3, abs=1e-12)


def test_both_stored_conventions_give_the_same_opencv_camera():
    T_world_opencv = opengl_camera_looking_along_world_y(0.2) @ T_OPENGL_OPENCV
    stored = {"opencv": T_world_opencv, "opengl": opengl_camera_looking_along_world_y(0.2)}
    assert set(stored) == set(T_STORED_OPENCV)
    for axes, T_world_stored in stored.items():
        assert np.array_equal(T_world_stored @ T_STORED_OPENCV[axes], T_world_opencv)
