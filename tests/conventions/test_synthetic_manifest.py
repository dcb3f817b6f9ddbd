"""The manifest of synthetic data says what the generator does."""

import pytest

from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.dataset import CameraModel
from wsm_data.synth.config import CAMERAS, SynthConfig
from wsm_data.synth.writers.cloud import OBSTACLE_RGB, PATH_RGB

DATASET, CONFIG = load_dataset("synthetic"), SynthConfig()


def test_the_cameras_are_those_that_render():
    rendered = {
        name: CameraModel(width=K.width, height=K.height, fx=K.fx, fy=K.fy, cx=K.cx, cy=K.cy)
        for name, K in CAMERAS.items()
    }
    assert DATASET.cameras == rendered


def test_the_robot_and_the_depth_scale_are_those_of_the_expert_and_the_sensor():
    assert DATASET.robot.radius_m == CONFIG.robot_radius_m
    assert DATASET.robot.ground_clearance_m == CONFIG.ground_clearance_m
    assert DATASET.depth.metres_per_unit == CONFIG.metres_per_depth_unit
    assert DATASET.max_camera_height_m >= CONFIG.max_camera_height_m
    assert DATASET.max_pitch_deg >= CONFIG.max_pitch_deg


def test_the_colours_of_the_cloud_are_those_that_are_painted():
    # 128 of 255 is the nearest level to the published 0.5
    assert [value / 255 for value in OBSTACLE_RGB] == pytest.approx(DATASET.cloud.obstacle_rgb, abs=0.5 / 255)
    assert [value / 255 for value in PATH_RGB] == list(DATASET.cloud.path_rgb)
