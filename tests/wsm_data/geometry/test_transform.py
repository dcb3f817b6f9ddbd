"""Rigid transforms: the group's laws, poses in the first camera's frame, and what is not rigid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from wsm_data.geometry.transform import (
    invert,
    relative_to_first,
    rigidity_error,
    rotation_angle_rad,
    transform_points,
    transforms_from_vectors,
    vectors_from_transforms,
)

ROUNDING_M = 1e-12  # float64 rounding at 100 m, a few operations
POINTS = st.tuples(*[st.floats(-100, 100)] * 3).map(np.array)


def some_transforms(count, seed=3):
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix()
    T[:, :3, 3] = rng.uniform(-5, 5, (count, 3))
    return T


@given(st.data())
def test_a_transform_times_its_inverse_is_the_identity_on_both_sides(transforms, data):
    T = data.draw(transforms)
    np.testing.assert_allclose(T @ invert(T), np.eye(4), rtol=0, atol=ROUNDING_M)
    np.testing.assert_allclose(invert(T) @ T, np.eye(4), rtol=0, atol=ROUNDING_M)


@given(st.data())
def test_the_inverse_is_the_general_matrix_inverse(transforms, data):
    T = data.draw(transforms)
    np.testing.assert_allclose(invert(T), np.linalg.inv(T), rtol=0, atol=ROUNDING_M)


@given(st.data())
def test_the_inverse_of_a_product_is_the_product_of_inverses_in_reverse(transforms, data):
    T_a_b, T_b_c = data.draw(transforms), data.draw(transforms)
    np.testing.assert_allclose(invert(T_a_b @ T_b_c), invert(T_b_c) @ invert(T_a_b), rtol=0, atol=ROUNDING_M)


@given(st.data(), POINTS)
def test_points_pass_through_a_chain_one_transform_after_the_other(transforms, data, point_c):
    T_a_b, T_b_c = data.draw(transforms), data.draw(transforms)
    step_by_step = transform_points(T_a_b, transform_points(T_b_c, point_c[None]))
    np.testing.assert_allclose(transform_points(T_a_b @ T_b_c, point_c[None]), step_by_step, rtol=0, atol=ROUNDING_M)


@given(st.data(), POINTS)
def test_points_are_moved_as_homogeneous_coordinates_say(transforms, data, point):
    T = data.draw(transforms)
    np.testing.assert_allclose(transform_points(T, point[None])[0], (T @ [*point, 1.0])[:3], rtol=0, atol=ROUNDING_M)


def test_points_are_moved_by_the_transform_of_their_own_batch():
    T, points = some_transforms(4), np.random.default_rng(1).normal(size=(4, 7, 3))
    moved = transform_points(T, points)
    assert moved.shape == (4, 7, 3)
    np.testing.assert_allclose(moved[2], transform_points(T[2], points[2]), rtol=0, atol=1e-15)


def test_distances_are_kept():
    T, points = some_transforms(1)[0], np.random.default_rng(1).normal(size=(2, 3))
    before, after = points[0] - points[1], np.diff(transform_points(T, points), axis=0)
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), rel=1e-14)


def test_the_first_pose_becomes_the_identity_exactly():
    relative = relative_to_first(some_transforms(5))
    assert relative[0].tolist() == np.eye(4).tolist()


def test_relative_poses_put_back_after_the_first_give_the_world_poses():
    T_world_camera = some_transforms(5)
    T_camera0_camera = relative_to_first(T_world_camera)
    np.testing.assert_allclose(T_world_camera[0] @ T_camera0_camera, T_world_camera, rtol=0, atol=1e-14)


@given(st.data())
def test_relative_poses_do_not_depend_on_the_choice_of_the_world(transforms, data):
    T_world_camera = some_transforms(4)
    moved_world = data.draw(transforms) @ T_world_camera
    np.testing.assert_allclose(
        relative_to_first(moved_world), relative_to_first(T_world_camera), rtol=0, atol=ROUNDING_M
    )


def test_relative_poses_leave_their_input_alone():
    T_world_camera = some_transforms(3)
    T_world_camera.flags.writeable = False  # as in an EpisodeRecord
    relative_to_first(T_world_camera)


@given(st.data())
def test_transforms_to_vectors_and_back_is_the_identity(transforms, data):
    T = data.draw(transforms)
    vector = vectors_from_transforms(T)
    assert vector.shape == (7,)
    assert vector[:3].tolist() == T[:3, 3].tolist()
    assert vector[3] >= 0
    np.testing.assert_allclose(transforms_from_vectors(vector), T, rtol=0, atol=1e-14)


def test_a_vector_rounded_to_float32_still_gives_a_rigid_transform():
    vectors = vectors_from_transforms(some_transforms(50)).astype(np.float32)
    assert rigidity_error(transforms_from_vectors(vectors)).max() < 1e-14
    np.testing.assert_allclose(transforms_from_vectors(vectors), some_transforms(50), rtol=0, atol=1e-6)


@given(st.data())
def test_rigid_transforms_have_no_rigidity_error(transforms, data):
    assert rigidity_error(data.draw(transforms)) < 1e-14


def spoil(change):
    T = some_transforms(1)[0]
    change(T)
    return rigidity_error(T)


def test_scale_is_seen_as_the_change_of_volume():
    def scale(T):
        T[:3, :3] *= 1.01

    assert spoil(scale) == pytest.approx(1.01**3 - 1, rel=1e-9)  # more than the 1.01^2 - 1 of the lengths


def test_shear_is_seen_as_the_lost_right_angle():
    def shear(T):
        T[:3, :3] = T[:3, :3] @ [[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]  # keeps the volume

    assert spoil(shear) == pytest.approx(0.01, rel=1e-9)


def test_a_mirror_is_seen_though_all_its_angles_are_right():
    def mirror(T):
        T[:3, 1] *= -1

    assert spoil(mirror) == pytest.approx(2, rel=1e-12)


def test_a_projective_last_row_is_seen():
    def project(T):
        T[3, 0] = 0.5

    assert spoil(project) == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("entry", [(0, 0), (1, 3), (3, 3)])
def test_a_number_that_is_not_finite_is_infinitely_far_from_rigid(bad, entry):
    T = some_transforms(3)
    T[1][entry] = bad
    error = rigidity_error(T)
    assert np.isinf(error[1])
    assert error[[0, 2]].max() < 1e-14


def test_a_wrong_translation_is_still_rigid():
    assert spoil(lambda T: T[:3, 3].fill(1e6)) < 1e-14


@given(st.floats(0, np.pi))
def test_the_angle_of_a_rotation_is_the_length_of_its_rotation_vector(angle):
    axis = np.array([1.0, -2.0, 2.0]) / 3
    measured = rotation_angle_rad(Rotation.from_rotvec(angle * axis).as_matrix())
    assert measured == pytest.approx(angle, abs=4e-16 + 1e-15 * angle)


def test_the_angle_of_a_rotation_the_other_way_is_not_negative():
    assert rotation_angle_rad(Rotation.from_rotvec([[0, 0, -0.3], [0, 0, 0.3]]).as_matrix()) == pytest.approx(
        [0.3, 0.3], rel=1e-14
    )
