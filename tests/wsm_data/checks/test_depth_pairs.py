"""A wall and its motion, whose errors are known in closed form."""

import numpy as np
import pytest

from wsm_data.checks.depth_pairs import depth_pair, relative_errors
from wsm_data.geometry.camera import project
from wsm_data.geometry.transform import transform_points, transforms_from_vectors
from wsm_data.schema.camera import Intrinsics

INTRINSICS = Intrinsics(fx=40.0, fy=40.0, cx=31.5, cy=23.5, width=64, height=48)


def wall(depth_m):
    return np.full((48, 64), depth_m, np.float32)


def ahead(step_m):
    """A camera that moved forward: points come nearer."""
    T_b_a = np.eye(4)
    T_b_a[2, 3] = -step_m
    return T_b_a


@pytest.mark.parametrize("claimed_m", [0.0, 0.5, 1.0, -0.5])
def test_the_error_at_a_wall_is_the_motion_that_was_claimed_too_little(claimed_m):
    pair = depth_pair(0, 1, {0: wall(4.0), 1: wall(3.5)}, INTRINSICS, max_points=4000)
    errors = relative_errors(pair, ahead(claimed_m), INTRINSICS)
    # float32 depths of 4 and 3.5 m are exact; the rest is rounding of float64
    np.testing.assert_allclose(errors[np.isfinite(errors)], (4.0 - claimed_m) / 3.5 - 1, atol=1e-12)
    assert np.isfinite(errors).sum() > 1000


def test_a_slanted_plane_is_met_between_pixels_without_error():
    """1 / z of a plane is linear in the image, and so is what is compared."""
    slope = 0.02 * np.arange(64) / 64
    near, moved_m = (1 / (0.25 + slope)).astype(np.float32), np.eye(4)
    pair = depth_pair(0, 1, {0: np.tile(near, (48, 1)), 1: np.tile(near, (48, 1))}, INTRINSICS, max_points=4000)
    moved_m[1, 3] = 0.03  # along the plane's own lines of equal depth
    errors = relative_errors(pair, moved_m, INTRINSICS)
    assert np.nanmax(np.abs(errors)) < 1e-6  # float32 depth


def test_what_frame_b_does_not_see_measure_or_sees_at_an_edge_is_no_number():
    seen = wall(4.0)
    seen[:, :20] = 0
    seen[:, 40:] = 3.0
    pair = depth_pair(0, 1, {0: wall(4.0), 1: seen}, INTRINSICS, max_points=4000)
    finite = np.isfinite(relative_errors(pair, np.eye(4), INTRINSICS)).reshape(48, 64)
    assert not finite[:, :20].any()
    assert finite[:-1, 20:39].all()
    assert not finite[:, 39].any()  # between 4 m and 3 m
    assert np.isnan(relative_errors(pair, ahead(5.0), INTRINSICS)).all()  # behind the camera


@pytest.mark.parametrize(("max_points", "kept"), [(4000, 3072), (3000, 768), (100, 88)])
def test_points_lie_on_a_square_lattice_of_at_most_so_many_pixels(max_points, kept):
    pair = depth_pair(0, 1, {0: wall(4.0), 1: wall(4.0)}, INTRINSICS, max_points)
    assert len(pair.points_a_m) == kept


def test_pixels_without_measurement_are_no_points():
    depth = wall(4.0)
    depth[:24] = 0
    assert len(depth_pair(0, 1, {0: depth, 1: depth}, INTRINSICS, 4000).points_a_m) == 24 * 64


def test_points_are_warped_as_by_the_projection_of_the_geometry_module():
    """A slow reference: the corner of the room from a camera that moved and turned, all formulas from `geometry`."""
    rng = np.random.default_rng(0)
    depth = {0: wall(4.0), 1: (3.5 + np.add.outer(0.01 * np.arange(48), 0.004 * np.arange(64))).astype(np.float32)}
    depth[1][rng.random((48, 64)) < 0.05] = 0
    pair = depth_pair(0, 1, depth, INTRINSICS, max_points=4000)
    T_b_a = transforms_from_vectors(np.array([0.2, -0.1, -0.4, 0.99, 0.02, -0.1, 0.03]))
    pixels, z_m = project(transform_points(T_b_a, pair.points_a_m), INTRINSICS)
    compared = 0
    for (u, v), z, error in zip(pixels, z_m, relative_errors(pair, T_b_a, INTRINSICS), strict=True):
        column, row = int(np.floor(u)), int(np.floor(v))
        around = depth[1][max(row, 0) : row + 2, max(column, 0) : column + 2].astype(np.float64)
        visible = column >= 0 and row >= 0 and around.shape == (2, 2) and around.min() > 0
        if not visible or around.max() > 1.1 * around.min():
            assert np.isnan(error)
            continue
        x, y = u - column, v - row
        inverse_m = np.array([1 - y, y]) @ (1 / around) @ np.array([1 - x, x])
        assert error == pytest.approx(z * inverse_m - 1, abs=1e-12)
        compared += 1
    assert compared > 500
