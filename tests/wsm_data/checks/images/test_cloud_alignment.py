"""Two walls that meet in a corner and a floor, seen from a camera that goes along one of them."""

import numpy as np
import pytest

from wsm_data.checks.images.cloud_alignment import check_cloud_alignment
from wsm_data.errors import Reason
from wsm_data.geometry.transform import invert, transform_points
from wsm_data.maps.scene_map import build_scene_map
from wsm_data.maps.voxels import voxels_from_depth
from wsm_data.schema.dataset import Robot

RNG = np.random.default_rng(0)
U, V = RNG.uniform(0, 3, 60_000), RNG.uniform(0, 1, 60_000)
SURFACE_M = np.concatenate(
    [
        np.column_stack([U, 0 * U, V]),
        np.column_stack([0 * U, U, V]),
        np.column_stack([U, RNG.uniform(0, 3, 60_000), 0 * U]),
    ]
)
LEVEL = build_scene_map(voxels_from_depth([SURFACE_M]), (0.0,), Robot(), 2.0).levels[0]
POSES = np.tile(np.eye(4), (12, 1, 1))
POSES[:, :3, 3] = np.linspace((1.0, 1.5, 0.5), (2.2, 1.8, 0.5), 12)
SEEN = {t: transform_points(invert(POSES[t]), SURFACE_M[RNG.integers(0, len(SURFACE_M), 400)]) for t in range(12)}


def check(poses=POSES, points=SEEN):
    return check_cloud_alignment(points, poses, LEVEL, "a/b/0")


def test_what_fits_fits_best_as_it_is():
    verdict = check()
    assert verdict.keep
    assert verdict.measured["aligned_share"] > 0.99


def turned(deg):
    c, s = np.cos(np.deg2rad(deg)), np.sin(np.deg2rad(deg))
    return POSES @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


@pytest.mark.parametrize(
    ("poses", "points", "named"),
    [
        (turned(5), SEEN, "turned by -5 degrees"),
        (POSES + 0.1 * np.eye(4)[2][:, None] * np.eye(4)[3], SEEN, "-0.1 m higher"),
        (POSES[np.clip(np.arange(12) - 3, 0, 11)], SEEN, "those of +3 frames"),
        (POSES, {t: 1.1 * points for t, points in SEEN.items()}, "depth were 0.91 times as large"),
    ],
)
def test_what_fits_clearly_better_is_named(poses, points, named):
    verdict = check(poses, points)
    assert verdict.reason is Reason.CLOUD_MISALIGNED
    assert named in verdict.message


def test_noise_prefers_no_other_meaning():
    noisy = {t: points * (1 + 0.01 * RNG.normal(size=points.shape)) for t, points in SEEN.items()}
    assert check(points=noisy).keep


def test_few_points_tell_nothing():
    assert check(points={0: SEEN[0]}).measured == {"alignment_points": 400}
