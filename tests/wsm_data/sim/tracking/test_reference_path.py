from itertools import pairwise

import numpy as np
import pytest

from wsm_data.sim.tracking.reference_path import reference_points


def slowly(path, position):
    """The rule word by word."""
    n = len(path)
    fine = []
    for index in np.linspace(0, n - 1, 50 * n):
        i = min(int(index), n - 2)
        fine.append(path[i] + (index - i) * (path[i + 1] - path[i]))
    c = np.cumsum([np.linalg.norm(b - a) for a, b in pairwise(fine)])
    k = int(np.argmin([np.linalg.norm(p - position) for p in fine]))
    taken = []
    for i in range(k, 50 * n - 1):
        if len(taken) < 6 and c[i] - c[k] >= 0.15 * len(taken):
            taken.append(fine[i])
    return np.array(taken + [path[-1]] * (6 - len(taken)))


def test_the_published_points_of_a_straight_path_come_out():
    path = np.column_stack([0.25 * np.arange(1, 25), np.zeros(24)])
    found = reference_points(path, np.zeros(2))
    np.testing.assert_allclose(found[:, 0], [0.25, 0.4035, 0.5521, 0.7008, 0.8543, 1.0029], atol=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_random_paths_give_what_the_rule_says(seed):
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal(size=(int(rng.integers(2, 30)), 2)) * rng.choice([0.01, 0.1, 0.5]), axis=0)
    position = path[int(rng.integers(len(path)))] + rng.normal(size=2) * 0.1
    np.testing.assert_allclose(reference_points(path, position), slowly(path, position), atol=1e-12)


def test_a_robot_at_the_end_of_the_path_is_given_the_end():
    path = np.column_stack([np.linspace(0, 1, 5), np.zeros(5)])
    assert (reference_points(path, np.array([2.0, 0.0])) == (1.0, 0.0)).all()


def test_a_path_that_stands_still_gives_its_one_point():
    assert (reference_points(np.ones((24, 2)), np.zeros(2)) == 1.0).all()
