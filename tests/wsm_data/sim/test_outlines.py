"""Distances to a mesh against distances to dense samples of it."""

import numpy as np
import pytest

from wsm_data.sim.outlines import mesh_outlines


def samples(triangles, low, high):
    share = np.random.default_rng(0).dirichlet([1, 1, 1], 60_000)
    points = np.concatenate([share @ triangle for triangle in triangles])
    return points[(points[:, 2] >= low) & (points[:, 2] <= high)][:, :2]


@pytest.mark.parametrize("seed", range(4))
def test_clearance_is_that_of_the_part_of_each_triangle_between_the_heights(seed):
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(0, 1, (3, 3, 3)) * (2, 2, 0.6)
    positions = rng.uniform(-0.5, 2.5, (40, 2))
    found = mesh_outlines(triangles, 0.15, 0.3).clearance_m(positions, 5.0)
    cloud = samples(triangles, 0.15, 0.3)
    slow = np.linalg.norm(positions[:, None] - cloud, axis=2).min(axis=1)
    inside = found == 0
    np.testing.assert_allclose(found[~inside], slow[~inside], atol=0.02)
    assert (slow[inside] < 0.05).all()


def test_what_lies_below_or_above_is_not_there():
    flat = np.array([[[0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]], [[0, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5]]], float)
    assert mesh_outlines(flat, 0.15, 0.3).clearance_m(np.array([[0.2, 0.2]]), 3.0)[0] == 3.0


def test_a_table_top_at_the_robot_s_height_is_touched_all_over():
    top = np.array([[[0, 0, 0.2], [4, 0, 0.2], [0, 4, 0.2]]], float)
    assert mesh_outlines(top, 0.15, 0.3).clearance_m(np.array([[1.0, 1.0], [-1.0, 1.0]]), 3.0).tolist() == [0.0, 1.0]


def test_nothing_is_looked_for_beyond_the_limit():
    wall = np.array([[[0, 0, 0], [0, 5, 0], [0, 5, 1]]], float)
    found = mesh_outlines(wall, 0.15, 0.3).clearance_m(np.array([[0.4, 3.0], [9.0, 3.0], [-40.0, 90.0]]), 0.75)
    np.testing.assert_allclose(found, [0.4, 0.75, 0.75])
