"""A corner of a room: points on a floor and two walls, which fix all six degrees of freedom."""

import numpy as np
import pytest


@pytest.fixture(scope="session")
def corner_m():
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0, 2, (2, 12_000))
    zero = np.zeros(4000)
    walls = [(a[:4000], b[:4000], zero), (a[4000:8000], zero, b[4000:8000]), (zero, a[8000:], b[8000:])]
    return np.concatenate([np.stack(wall, axis=1) for wall in walls])
