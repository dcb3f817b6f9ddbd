"""An L of two walls and a floor, seen exactly; and clouds of it that stand elsewhere."""

import numpy as np
import pytest

from wsm_data.checks.cloud_agreement import MIN_POINTS, check_cloud_agreement, height_bands
from wsm_data.errors import Reason
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_depth
from wsm_data.schema.dataset import Robot

LIMIT = 0.75


def room(step_m):
    """Floor of 4 m x 3 m, a wall at x = 4 m, one of 2 m at y = 3 m and a pillar, so that no symmetry is left."""
    a, b = (np.arange(0, n, step_m) + step_m / 2 for n in (4.0, 3.0))
    z = np.arange(0, 1.5, step_m) + step_m / 2
    floor = np.stack(np.meshgrid(a, b, [0.0]), axis=-1).reshape(-1, 3)
    far = np.stack(np.meshgrid([4.0], b, z), axis=-1).reshape(-1, 3)
    side = np.stack(np.meshgrid(a[a < 2], [3.0], z), axis=-1).reshape(-1, 3)
    pillar = np.stack(np.meshgrid(a[(a > 1) & (a < 1.4)], [1.2], z), axis=-1).reshape(-1, 3)
    return np.concatenate([floor, far, side, pillar])


SEEN = height_bands(room(0.1), 0.0, Robot(), 1.2)


def verdict(cloud_m, bands=SEEN):
    level = build_scene_map(voxels_from_depth([cloud_m]), (0.0,), Robot(), 2.0).levels[0]
    return check_cloud_agreement(bands, level, "hall/000000", LIMIT)


def test_points_are_sorted_by_their_height_over_the_floor():
    points = np.array([[0, 0, 9.8], [0, 0, 9.9], [0, 0, 10.1], [0, 0, 10.2], [0, 0, 10.9], [0, 0, 11.3]])
    bands = height_bands(points, 10.0, Robot(ground_clearance_m=0.15), 1.2)
    assert bands.ground_m[:, 2].tolist() == [9.9, 10.1]
    assert bands.upright_m[:, 2].tolist() == [10.2, 10.9]


def test_a_cloud_that_shows_what_is_seen_is_kept():
    one = verdict(room(0.03))
    assert one.keep
    assert one.measured == {"floor_points_near_cloud": 1.0, "upright_points_near_cloud": 1.0}


@pytest.mark.parametrize(
    ("moved", "fits"),
    [
        (lambda p: p + np.array([30.0, 0, 0]), "shifted by (+30.00, +0.00) m"),
        (lambda p: p + np.array([-0.5, 0.3, 0]), "shifted by (-0.50, +0.30) m"),
        (lambda p: p + np.array([0, 0, 1.2]), "+1.20 m too high"),
        (lambda p: p * (-1, 1, 1), "mirrored along x"),
        (lambda p: np.column_stack([-p[:, 1], p[:, 0], p[:, 2]]), "turned by 90 degrees"),
        (lambda p: room(0.005)[::3] * 10, "10 times too large"),
    ],
)
def test_a_cloud_of_another_frame_is_refused_and_what_fits_is_named(moved, fits):
    one = verdict(moved(room(0.03)))
    assert (one.reason, one.measured["fits"]) == (Reason.CLOUD_DISAGREES, fits)
    assert fits in one.message


def test_a_cloud_of_another_place_fits_nowhere():
    rng = np.random.default_rng(0)
    one = verdict(rng.uniform((-5, -5, 0), (5, 5, 1.5), (3000, 3)))
    assert (one.reason, one.measured["fits"]) == (Reason.CLOUD_DISAGREES, None)


def test_few_points_tell_nothing():
    few = height_bands(room(0.1)[: MIN_POINTS - 1], 0.0, Robot(), 1.2)
    assert verdict(room(0.03) + np.array([30.0, 0, 0]), few).keep
