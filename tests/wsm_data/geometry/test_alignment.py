"""Alignment against planted maps, and against a search that knows no closed form."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.alignment import Similarity, align_points

ROUNDING = 1e-12


def planted(seed, scale):
    rng = np.random.default_rng(seed)
    return Similarity(
        scale=scale, rotation=Rotation.random(random_state=seed).as_matrix(), translation_m=rng.normal(size=3) * 5
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("with_scale", "scale"), [(True, 0.3), (True, 4.0), (False, 1.0)])
def test_a_planted_map_is_recovered_from_exact_points(seed, with_scale, scale):
    source, truth = np.random.default_rng(seed).normal(size=(30, 3)), planted(seed, scale)
    found = align_points(source, truth.apply(source), with_scale=with_scale)
    assert found.scale == pytest.approx(scale, rel=ROUNDING)
    np.testing.assert_allclose(found.rotation, truth.rotation, atol=ROUNDING)
    np.testing.assert_allclose(found.translation_m, truth.translation_m, atol=1e-11)


def test_points_in_a_plane_are_enough():
    source, truth = np.random.default_rng(0).normal(size=(30, 3)) * (1, 1, 0), planted(1, 2.0)
    np.testing.assert_allclose(
        align_points(source, truth.apply(source), with_scale=True).rotation, truth.rotation, atol=ROUNDING
    )


def test_a_mirror_image_is_not_mirrored_back():
    source = np.random.default_rng(0).normal(size=(30, 3))
    found = align_points(source, source * (1, 1, -1), with_scale=True)
    assert np.linalg.det(found.rotation) == pytest.approx(1, abs=ROUNDING)


def test_no_search_finds_a_smaller_error():
    rng = np.random.default_rng(3)
    source = rng.normal(size=(12, 3))
    target = planted(4, 1.7).apply(source) + rng.normal(size=(12, 3)) * 0.3
    found = align_points(source, target, with_scale=True)

    def squares(x):
        return np.square(np.exp(x[0]) * source @ Rotation.from_rotvec(x[1:4]).as_matrix().T + x[4:] - target).sum()

    ours = np.square(found.apply(source) - target).sum()
    start = np.concatenate(
        [[np.log(found.scale)], Rotation.from_matrix(found.rotation).as_rotvec(), found.translation_m]
    )
    searched = min(minimize(squares, start + rng.normal(size=7) * 0.2, method="BFGS").fun for _ in range(5))
    assert ours == pytest.approx(searched, rel=1e-6)


@pytest.mark.parametrize(
    "points",
    [np.zeros((5, 3)), np.outer(np.arange(5.0), [1, 2, 3]), np.eye(3)[:2]],
    ids=["one place", "one line", "two points"],
)
def test_points_that_leave_the_rotation_open_are_refused(points):
    with pytest.raises(DataError, match="one line") as refusal:
        align_points(points, points + 1.0, with_scale=True)
    assert refusal.value.reason == Reason.TRAJECTORY_DEGENERATE


def test_maps_compose():
    first, second = planted(1, 2.0), planted(2, 0.5)
    points = np.random.default_rng(0).normal(size=(4, 3))
    np.testing.assert_allclose(second.after(first).apply(points), second.apply(first.apply(points)), atol=ROUNDING * 10)
