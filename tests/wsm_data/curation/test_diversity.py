import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.diversity import DiversityConfig, discrete_frechet_m, paths_are_near

POINT = st.tuples(*[st.floats(-3, 3, width=32)] * 2)
PATHS = st.lists(POINT, min_size=1, max_size=7).map(lambda points: np.array(points, np.float32))


def slow_frechet(a, b):
    """The recursion of Eiter and Mannila, as they wrote it."""

    @cache
    def leash(i, j):
        distance = math.dist(a[i].tolist(), b[j].tolist())
        if i == 0 and j == 0:
            return distance
        before = [leash(*place) for place in ((i - 1, j), (i - 1, j - 1), (i, j - 1)) if min(place) >= 0]
        return max(min(before), distance)

    return leash(len(a) - 1, len(b) - 1)


@given(PATHS, PATHS)
def test_the_distance_is_that_of_the_recursion(a, b):
    assert discrete_frechet_m(a, b) == pytest.approx(slow_frechet(a, b), abs=1e-12)


@given(PATHS, PATHS, st.floats(0.1, 5))
def test_paths_are_near_where_their_distance_is_no_more(a, b, within_m):
    distance_m = discrete_frechet_m(a, b)
    assert paths_are_near(a, b, within_m) == (distance_m <= within_m)
    assert paths_are_near(a, b, distance_m)


@given(PATHS, PATHS)
def test_the_distance_is_symmetric(a, b):
    assert discrete_frechet_m(a, b) == discrete_frechet_m(b, a)


@given(PATHS, PATHS, PATHS)
def test_the_triangle_inequality_holds(a, b, c):
    assert discrete_frechet_m(a, c) <= discrete_frechet_m(a, b) + discrete_frechet_m(b, c) + 1e-9


def test_parallel_lines_are_as_far_apart_as_they_are_and_the_way_back_is_far():
    line = np.stack([np.linspace(0, 10, 32), np.zeros(32)], axis=1).astype(np.float32)
    beside = line + np.array([0, 0.3], np.float32)
    assert discrete_frechet_m(line, beside) == pytest.approx(0.3)
    assert discrete_frechet_m(line, line[::-1].copy()) == pytest.approx(10)


@pytest.mark.parametrize("within_m", [-0.1, float("nan"), float("inf")])
def test_a_distance_below_0_is_refused(within_m):
    with pytest.raises(ValueError, match="within_m must be 0 or more"):
        DiversityConfig(within_m=within_m)
