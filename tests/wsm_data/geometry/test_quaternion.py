"""Quaternions against scipy's Rotation, at every angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from wsm_data.geometry.quaternion import matrices_from_quaternions, quaternions_from_matrices

ROUNDING = 1e-15 * 8  # float64 rounding of a few products of numbers of size one

HALF_TURNS = [
    Rotation.from_rotvec(np.pi * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, -1, 1], [-2, 1, 3])
]


def scipy_quaternion(matrix):
    return Rotation.from_matrix(matrix).as_quat(scalar_first=True)


@given(st.data())
def test_matrix_to_quaternion_and_back_is_the_identity(rotations, data):
    matrix = data.draw(rotations)
    np.testing.assert_allclose(
        matrices_from_quaternions(quaternions_from_matrices(matrix)), matrix, rtol=0, atol=ROUNDING
    )


@given(st.data())
def test_the_quaternion_is_unit_with_w_not_negative(rotations, data):
    q = quaternions_from_matrices(data.draw(rotations))
    assert np.linalg.norm(q) == pytest.approx(1, abs=ROUNDING)
    assert q[0] >= 0


@given(st.data())
def test_the_quaternion_is_scipys_up_to_sign(rotations, data):
    matrix = data.draw(rotations)
    ours, theirs = quaternions_from_matrices(matrix), scipy_quaternion(matrix)
    np.testing.assert_allclose(ours * np.sign(ours @ theirs), theirs, rtol=0, atol=ROUNDING)


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 1e-3))
def test_the_matrix_of_a_quaternion_is_scipys_whatever_its_length(q):
    expected = Rotation.from_quat(q, scalar_first=True).as_matrix()
    np.testing.assert_allclose(matrices_from_quaternions(np.array(q)), expected, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(matrices_from_quaternions(np.array(q) * -3), expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("matrix", HALF_TURNS)
def test_half_turns_keep_full_accuracy(matrix):
    q = quaternions_from_matrices(matrix)
    assert q[0] == pytest.approx(0, abs=ROUNDING)
    np.testing.assert_allclose(matrices_from_quaternions(q), matrix, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("angle", np.linspace(-2 * np.pi, 2 * np.pi, 73))
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_about_an_axis_has_the_textbook_quaternion(angle, axis):
    vector = np.zeros(3)
    vector[axis] = 1
    textbook = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * vector])
    q = quaternions_from_matrices(Rotation.from_rotvec(angle * vector).as_matrix())
    assert abs(q @ textbook) == pytest.approx(1, abs=ROUNDING)
    assert q[0] >= 0


def test_the_identity_is_exact():
    assert quaternions_from_matrices(np.eye(3)).tolist() == [1, 0, 0, 0]
    assert matrices_from_quaternions(np.array([1.0, 0, 0, 0])).tolist() == np.eye(3).tolist()


def test_a_batch_is_each_of_its_members():
    matrices = Rotation.random(24, random_state=5).as_matrix().reshape(2, 3, 4, 3, 3)
    q = quaternions_from_matrices(matrices)
    assert q.shape == (2, 3, 4, 4)
    assert np.array_equal(q[1, 2, 3], quaternions_from_matrices(matrices[1, 2, 3]))
    assert np.array_equal(matrices_from_quaternions(q)[0, 1, 2], matrices_from_quaternions(q[0, 1, 2]))
