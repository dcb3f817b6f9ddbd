"""Points near the boxes of a level, against every box looked at."""

import numpy as np

from wsm_data.maps.near_surface import near_surface
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.schema.dataset import Robot
from wsm_data.schema.surface import CELL_SIZE_M, LAYER_HEIGHT_M, SurfaceVoxels


def test_a_point_is_near_where_a_box_overlaps_the_cube_around_it():
    rng = np.random.default_rng(0)
    cells = np.unique(rng.integers((-8, -8, 0), (8, 8, 60), (400, 3)), axis=0).astype(np.int16)
    voxels = SurfaceVoxels(cells=cells, obstacle=np.zeros(len(cells), bool), origin="cloud")
    level = build_scene_map(voxels, (0.0,), Robot(), 2.0).levels[0]
    points = rng.uniform((-0.6, -0.6, -0.1), (0.6, 0.6, 0.8), (500, 3))
    size = np.array([CELL_SIZE_M, CELL_SIZE_M, LAYER_HEIGHT_M])
    low, high = np.floor((points - 0.05) / size), np.floor((points + 0.05) / size)
    expected = [bool(((cells >= a) & (cells <= b)).all(axis=1).any()) for a, b in zip(low, high, strict=True)]
    assert near_surface(level, points).tolist() == expected
    assert 50 < sum(expected) < 450


def test_nothing_is_near_an_empty_level():
    empty = SurfaceVoxels(cells=np.zeros((0, 3), np.int16), obstacle=np.zeros(0, bool), origin="cloud")
    level = build_scene_map(empty, (0.0,), Robot(), 2.0).levels[0]
    assert not near_surface(level, np.zeros((3, 3))).any()
