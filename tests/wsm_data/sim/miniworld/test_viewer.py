import numpy as np

from wsm_data.geometry.camera import T_OPENGL_OPENCV, project
from wsm_data.schema.camera import Intrinsics
from wsm_data.sim.miniworld.viewer import FAR_M, NEAR_M, projection

CAMERA = Intrinsics(fx=470.0, fy=430.0, cx=300.5, cy=190.25, width=640, height=360)


def test_the_projection_puts_points_into_the_pixels_where_the_pinhole_has_them():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-2, 2, 100), rng.uniform(-1, 1, 100), rng.uniform(0.2, 20, 100)])
    clip = np.column_stack([points @ T_OPENGL_OPENCV[:3, :3].T, np.ones(100)]) @ projection(CAMERA).T
    cube = clip[:, :3] / clip[:, 3:]
    pixels = np.column_stack([(cube[:, 0] + 1) / 2 * 640 - 0.5, (1 - cube[:, 1]) / 2 * 360 - 0.5])
    assert np.abs(pixels - project(points, CAMERA)[0]).max() < 1e-9


def test_the_planes_of_the_projection_are_the_ends_of_the_depth_buffer():
    ends = np.array([[0, 0, -NEAR_M, 1], [0, 0, -FAR_M, 1]]) @ projection(CAMERA).T
    assert np.allclose(ends[:, 2] / ends[:, 3], [-1, 1])
