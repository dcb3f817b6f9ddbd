import numpy as np

from wsm_data.checks.cloud_fit import fitting_placement
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_depth
from wsm_data.schema.dataset import Robot


def corner(step_m):
    """Two walls of different length that meet at the origin, 1 m high."""
    z = np.arange(0.2, 1.2, step_m)
    one = np.stack(np.meshgrid(np.arange(0, 4, step_m), [0.0], z), axis=-1).reshape(-1, 3)
    two = np.stack(np.meshgrid([0.0], np.arange(0, 1, step_m), z), axis=-1).reshape(-1, 3)
    return np.concatenate([one, two])


def fits(cloud_m, points_m):
    level = build_scene_map(voxels_from_depth([cloud_m]), (0.0,), Robot(), 2.0).levels[0]
    return fitting_placement(level, points_m, points_m)


def test_a_cloud_with_y_up_is_named():
    points = corner(0.05)
    points[:, 1] -= 1.0  # so that what stands up lies at heights that a map holds
    stored = np.column_stack([points[:, 0], points[:, 2], -points[:, 1]])
    assert fits(stored, points) == "stored with y up"


def test_where_the_cloud_fits_as_it_is_nothing_is_clearly_better():
    assert fits(corner(0.03), corner(0.05)) is None


def test_an_empty_cloud_fits_nothing():
    assert fits(np.zeros((0, 3)), corner(0.05)) is None
