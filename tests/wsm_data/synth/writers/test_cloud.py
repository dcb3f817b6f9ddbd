import numpy as np
import pytest

from wsm_data.schema.dataset import CloudColours
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.cloud import scene_cloud, with_path


@pytest.fixture(scope="module")
def cloud(home):
    return scene_cloud(home, SynthConfig())


def test_obstacle_points_are_dark_blue_and_form_a_slice_near_the_floor(cloud):
    colours = CloudColours()
    distance = np.abs(cloud.rgb_u8 / 255.0 - colours.obstacle_rgb).sum(axis=1)
    blue = distance < colours.tolerance
    low, high = SynthConfig().obstacle_slice_m
    inside = (cloud.xyz_m[:, 2] > low + 1e-6) & (cloud.xyz_m[:, 2] < high - 1e-6)
    outside = (cloud.xyz_m[:, 2] < low - 1e-6) | (cloud.xyz_m[:, 2] > high + 1e-6)
    assert blue[inside].all()
    assert not blue[outside].any()
    assert blue.sum() > 20_000


def test_the_other_points_are_grey_and_neither_path_nor_obstacle(cloud):
    colours = CloudColours()
    scene = np.abs(cloud.rgb_u8 / 255.0 - colours.obstacle_rgb).sum(axis=1) >= colours.tolerance
    grey = cloud.rgb_u8[scene]
    assert (grey == grey[:, :1]).all()
    assert np.abs(grey / 255.0 - colours.path_rgb).sum(axis=1).min() > colours.tolerance
    assert len(np.unique(grey)) > 20


def test_every_floor_square_of_25_mm_holds_points(home, cloud):
    room = home.floor_plan.rooms[0]
    x, y, z = cloud.xyz_m.T
    on = (z == 0) & (x > room.x0) & (x < room.x1) & (y > room.y0) & (y < room.y1)
    counts, *_ = np.histogram2d(
        x[on], y[on], bins=[np.arange(room.x0, room.x1, 0.025)[:-1], np.arange(room.y0, room.y1, 0.025)[:-1]]
    )
    assert counts.min() >= 1
    assert counts.mean() > 1.4


def test_a_path_follows_the_unchanged_scene_in_black(cloud):
    path = np.column_stack([np.linspace(0, 1, 7), np.zeros(7), np.full(7, 0.9)])
    longer = with_path(cloud, path)
    count = len(cloud.xyz_m)
    assert (longer.xyz_m[:count] == cloud.xyz_m).all()
    assert (longer.xyz_m[count:] == path.astype(np.float32)).all()
    assert (longer.rgb_u8[count:] == 0).all()
