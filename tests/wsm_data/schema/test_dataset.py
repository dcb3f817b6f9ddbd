"""A manifest's defaults are those of InternData-N1's generator, and unknown axes are refused."""

import pytest

from wsm_data.schema.dataset import DatasetManifest, ReadLimits
from wsm_data.schema.depth import DepthEncoding

REQUIRED = {"name": "a", "licence": "CC-BY-4.0", "depth": DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))}


@pytest.mark.parametrize("axes", ["opengl", "opencv"])
def test_both_usual_camera_axes_are_known(axes):
    assert DatasetManifest(**REQUIRED, camera_axes=axes).camera_axes == axes


@pytest.mark.parametrize("axes", ["blender", "OpenGL", ""])
def test_other_camera_axes_are_refused(axes):
    with pytest.raises(ValueError, match=f"camera_axes must be 'opengl' or 'opencv', found {axes!r}"):
        DatasetManifest(**REQUIRED, camera_axes=axes)


def test_the_robot_is_the_one_its_expert_planned_for():
    robot = DatasetManifest(**REQUIRED).robot
    assert (robot.radius_m, robot.ground_clearance_m) == (0.25, 0.15)


def test_obstacles_are_dark_blue_and_paths_black():
    cloud = DatasetManifest(**REQUIRED).cloud
    assert (cloud.obstacle_rgb, cloud.path_rgb, cloud.tolerance) == ((0.0, 0.0, 0.5), (0.0, 0.0, 0.0), 0.05)


@pytest.mark.parametrize("name", ["max_frames", "max_file_bytes", "max_json_bytes", "max_image_pixels"])
def test_a_limit_that_lets_nothing_through_is_refused(name):
    with pytest.raises(ValueError, match=name):
        ReadLimits(**{name: 0})
