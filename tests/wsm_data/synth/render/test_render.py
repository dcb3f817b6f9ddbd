import numpy as np
import pytest
from numba import njit

from wsm_data.geometry.camera import pixel_rays
from wsm_data.schema.camera import Intrinsics
from wsm_data.synth.render import rasteriser
from wsm_data.synth.render.rasteriser import NEAR_M
from wsm_data.synth.render.render import make_buffers, render

CAMERA = Intrinsics(fx=40.3, fy=38.9, cx=31.7, cy=23.4, width=64, height=48)
TINY = Intrinsics(fx=17.8, fy=17.6, cx=12.0, cy=6.75, width=24, height=14)


def looking(x: float, y: float, z: float, yaw: float, pitch: float) -> np.ndarray:
    """OpenCV camera to world, heading `yaw` from the x axis, `pitch` down."""
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T[:3, 3] = (x, y, z)
    return T


def cast(points_m: np.ndarray, T_world_camera: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Depth by ray casting, after Moeller and Trumbore (1997): every ray against every triangle, both sides."""
    R, origin = T_world_camera[:3, :3], T_world_camera[:3, 3]
    a, ab, ac = points_m[:, 0], points_m[:, 1] - points_m[:, 0], points_m[:, 2] - points_m[:, 0]
    depth = np.full(camera.height * camera.width, np.inf)
    for i, ray in enumerate(pixel_rays(camera).reshape(-1, 3) @ R.T):  # z = 1, so the way along it is the depth
        p = np.cross(ray, ac)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (ab * p).sum(axis=1)
            s = origin - a
            u = (s * p).sum(axis=1) * inverse
            q = np.cross(s, ab)
            v = q @ ray * inverse
            t = (ac * q).sum(axis=1) * inverse
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= NEAR_M)
        depth[i] = t[hit].min(initial=np.inf)
    return np.where(np.isinf(depth), 0.0, depth).reshape(camera.height, camera.width)


def relative_error(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    return np.abs(found - true) / np.maximum(true, 1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_depth_of_triangles_around_the_camera_is_that_of_ray_casting(bare_mesh, seed):
    # corners lie before, beside and behind the camera, so many triangles cross its plane
    points = np.random.default_rng(seed).normal(0, 1.5, (60, 3, 3))
    T = looking(0.1, -0.2, 0.3, 0.7 * seed, 0.2)
    _, depth_m = render(bare_mesh(points), T, CAMERA)
    true = cast(points, T, CAMERA)
    assert ((depth_m > 0) == (true > 0)).all()
    assert relative_error(depth_m, true).max() < 1e-6  # float32 alone errs by 6e-8


@pytest.mark.parametrize(("room", "yaw"), [(1, 0.4), (2, 2.3), (5, 4.1)])
def test_depth_in_a_home_is_that_of_ray_casting(home, standpoints, room, yaw):
    T = looking(*standpoints[room], 1.4, yaw, 0.3)
    _, depth_m = render(home.mesh, T, TINY)
    wrong = relative_error(depth_m, cast(home.mesh.points_m, T, TINY)) > 1e-6
    # a ray may graze the edge between two surfaces and be given to either
    assert wrong.mean() <= 0.005, np.argwhere(wrong)


def test_nothing_is_seen_through_the_seams_of_a_home(home, standpoints):
    for number, place in enumerate(standpoints):
        T = looking(*place, 1.3, 0.9 * number, 0.2)
        assert (render(home.mesh, T, CAMERA)[1] > 0).all()


def test_triangles_that_share_edges_through_pixel_centres_leave_no_gap(bare_mesh):
    camera = Intrinsics(fx=10, fy=10, cx=10, cy=10, width=21, height=21)
    corners = np.array([(x / 5, y / 5, 2.0) for y in range(-10, 11, 5) for x in range(-10, 11, 5)])
    cells = [(i, i + 1, i + 6, i + 5) for row in range(4) for i in range(5 * row, 5 * row + 4)]
    triangles = [corners[list(t)] for a, b, c, d in cells for t in ((a, b, c), (a, c, d))]
    _, depth_m = render(bare_mesh(np.array(triangles)), np.eye(4), camera)
    assert (depth_m == 2.0).all()


def test_the_centre_of_the_first_pixel_is_at_the_origin(bare_mesh):
    # a triangle just wide enough to hold the ray through pixel (3, 2) and no other
    u, v = (3 - CAMERA.cx) / CAMERA.fx, (2 - CAMERA.cy) / CAMERA.fy
    points = np.array([[(u - 0.01, v - 0.01, 1), (u + 0.01, v - 0.01, 1), (u, v + 0.01, 1)]])
    _, depth_m = render(bare_mesh(points), np.eye(4), CAMERA)
    assert np.argwhere(depth_m > 0).tolist() == [[2, 3]]


def test_a_wall_nearer_than_the_near_plane_is_not_drawn_and_one_behind_it_is(bare_mesh):
    def wall(z: float) -> np.ndarray:
        return np.array([[(-9, -9, z), (9, -9, z), (0, 18, z)]], np.float64)

    mesh = bare_mesh(np.concatenate([wall(0.5 * NEAR_M), wall(3.0)]))
    assert (render(mesh, np.eye(4), CAMERA)[1] == 3.0).all()


def test_the_back_of_a_closed_solid_is_skipped_and_that_of_a_leaf_is_drawn(bare_mesh):
    # seen from the camera its corners go clockwise: the side it turns to the camera is its front
    front = np.array([[(-9, -9, 2), (0, 18, 2), (9, -9, 2)]], np.float64)
    for points, seen in ((front, True), (front[:, ::-1], False)):
        assert render(bare_mesh(points, two_sided=False), np.eye(4), CAMERA)[1].any() == seen
        assert render(bare_mesh(points, two_sided=True), np.eye(4), CAMERA)[1].all()


def test_a_white_surface_under_full_light_is_white_and_nothing_is_black(bare_mesh):
    points = np.array([[(-9, -9, 2), (9, -9, 2), (0, 0, 2)]], np.float64)
    rgb_u8, depth_m = render(bare_mesh(points), np.eye(4), CAMERA)
    assert (rgb_u8[depth_m > 0] == 255).all()
    assert (rgb_u8[depth_m == 0] == 0).all()


def test_buffers_are_reused_and_those_of_another_size_refused(home, standpoints):
    buffers = make_buffers(home.mesh, TINY)
    T = looking(*standpoints[1], 1.2, 1.0, 0.3)
    rgb_u8, depth_m = render(home.mesh, T, TINY, buffers)
    assert rgb_u8 is buffers.rgb_u8
    fresh_rgb, fresh_depth = render(home.mesh, T, TINY)
    assert (rgb_u8 == fresh_rgb).all()
    assert (depth_m == fresh_depth).all()
    with pytest.raises(ValueError, match="make_buffers"):
        render(home.mesh, T, CAMERA, buffers)


def test_texture_and_light_between_the_ends_of_a_span_are_those_of_the_pixel(home, standpoints, monkeypatch):
    # spans of one pixel take every coordinate exactly
    T = looking(*standpoints[3], 0.9, 2.0, 0.3)
    fast = render(home.mesh, T, CAMERA)[0].astype(int)
    monkeypatch.setattr(rasteriser, "SPAN", 1)
    monkeypatch.setattr("wsm_data.synth.render.render.shade", njit(rasteriser.shade.py_func))
    exact = render(home.mesh, T, CAMERA)[0].astype(int)
    assert np.abs(fast - exact).mean() < 1.0
    assert np.quantile(np.abs(fast - exact), 0.99) < 12
