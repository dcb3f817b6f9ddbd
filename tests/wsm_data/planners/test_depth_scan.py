import numpy as np
import pytest

from wsm_data.planners.depth_scan import ScanConfig, scan_depth


def test_a_wall_ahead_ends_every_ray_and_the_floor_none(camera, look_at):
    scan = scan_depth(look_at(3.0), camera, ScanConfig())
    assert scan.hit.all()
    np.testing.assert_allclose(scan.free_x_m, 3.0, atol=1e-6)
    np.testing.assert_allclose(scan.obstacles_xy_m[:, 0], 3.0, atol=1e-6)
    assert scan.ray_slopes[0] == pytest.approx(camera.cx / camera.fx)  # the first column looks to the left


def test_rays_beside_a_narrow_wall_that_measure_nothing_say_nothing(camera, look_at):
    scan = scan_depth(look_at(2.0, (0.5, 50.0)), camera, ScanConfig())
    left = scan.ray_slopes * 2.0 >= 0.5
    assert (scan.hit == left).all()
    assert (scan.free_x_m[~left] == 0).all()


def test_a_wall_beyond_the_range_leaves_rays_free_up_to_the_range(camera, look_at):
    scan = scan_depth(look_at(8.0), camera, ScanConfig(range_m=5.0))
    assert not scan.hit.any()
    assert (scan.free_x_m == 5.0).all()
    assert len(scan.obstacles_xy_m) == 0


def test_a_picture_of_another_size_is_refused(camera):
    with pytest.raises(ValueError, match="depth must be 90 x 160"):
        scan_depth(np.ones((45, 80), np.float32), camera, ScanConfig())
