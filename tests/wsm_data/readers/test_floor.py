import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import pixel_rays
from wsm_data.readers.floor import floor_z_m
from wsm_data.schema.camera import Intrinsics

CAMERA = Intrinsics(fx=60.0, fy=60.0, cx=39.5, cy=29.5, width=80, height=60)


def looking_down(height_m, pitch_deg):
    """OpenCV camera to world that looks along y and down."""
    pitch = np.deg2rad(pitch_deg)
    T = np.eye(4)
    T[:3, :3] = np.array([[1, 0, 0], [0, -np.sin(pitch), np.cos(pitch)], [0, -np.cos(pitch), -np.sin(pitch)]])
    T[2, 3] = height_m
    return T


def depth_of_planes(T, *planes):
    """Depth of horizontal planes (z, y from which they begin, y at which they end), the nearest one wins."""
    rays = pixel_rays(CAMERA) @ T[:3, :3].T
    depth = np.full(rays.shape[:2], np.inf)
    for z, near, far in planes:
        with np.errstate(divide="ignore"):
            along = (z - T[2, 3]) / rays[..., 2]
        y = T[1, 3] + along * rays[..., 1]
        depth = np.where((along > 0) & (y >= near) & (y < far), np.minimum(depth, along), depth)
    return np.where(np.isfinite(depth), depth, 0).astype(np.float32)


def test_the_floor_is_the_lowest_surface_even_where_a_table_covers_much_of_the_view():
    T = looking_down(1.4, 45)
    depth = depth_of_planes(T, (0.1, 0, 10), (0.8, 0.0, 0.6))
    assert np.mean(depth_of_planes(T, (0.8, 0.0, 0.6)) > 0) > 0.4  # of the view
    assert floor_z_m([(depth, T)], CAMERA, "s") == pytest.approx(0.1, abs=0.002)


def test_a_hundredth_of_stray_points_below_is_no_floor():
    rng = np.random.default_rng(0)
    T = looking_down(1.4, 45)
    depth = depth_of_planes(T, (0.1, 0, 10))
    stray = rng.random(depth.shape) < 0.01
    depth = np.where(stray, depth * 1.5, depth).astype(np.float32)
    assert floor_z_m([(depth, T)], CAMERA, "s") == pytest.approx(0.1, abs=0.002)


def test_noise_of_two_centimetres_moves_the_floor_by_less_than_one():
    T = looking_down(1.2, 35)
    depth = depth_of_planes(T, (0.0, 0, 10))
    noisy = (depth + np.random.default_rng(1).normal(0, 0.02, depth.shape) * (depth > 0)).astype(np.float32)
    assert floor_z_m([(noisy, T)] * 3, CAMERA, "s") == pytest.approx(0.0, abs=0.01)


def test_a_camera_that_sees_only_a_wall_is_told_what_to_state():
    with pytest.raises(DataError, match=r"motion\.floor_z_m") as caught:
        floor_z_m([(np.full((60, 80), 2.0, np.float32), looking_down(1.2, 0))], CAMERA, "s")
    assert caught.value.reason is Reason.FLOOR_UNSEEN
