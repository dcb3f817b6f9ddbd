"""Random rotations and rigid transforms for hypothesis."""

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation


@st.composite
def _rotations(draw):
    """Rotation matrices about any axis by any angle, the difficult ones (0, tiny, a half turn) among them."""
    axis = np.array(draw(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: np.linalg.norm(a) > 1e-3)))
    angle = draw(st.floats(-np.pi, np.pi) | st.sampled_from([0.0, 1e-12, 1e-8, np.pi, -np.pi, np.pi - 1e-8]))
    return Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix()


@pytest.fixture(scope="session")
def rotations():
    """Strategy of rotation matrices [3, 3]."""
    return _rotations()


@pytest.fixture(scope="session")
def transforms():
    """Strategy of rigid transforms [4, 4] with translations up to 100 m."""

    def assemble(rotation, translation):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation, translation
        return T

    return st.builds(assemble, _rotations(), st.tuples(*[st.floats(-100, 100)] * 3))
