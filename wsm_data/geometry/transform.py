"""Rigid transforms `T_target_source`, with p_target = T_target_source @ p_source; float64 throughout."""

import numpy as np

from wsm_data.geometry.quaternion import matrices_from_quaternions, quaternions_from_matrices
from wsm_data.schema.arrays import Float64Array


def invert(T_target_source: Float64Array) -> Float64Array:
    """Inverse of rigid transforms [..., 4, 4]: the rotation is transposed, not solved for."""
    rotation = np.swapaxes(T_target_source[..., :3, :3], -1, -2)
    inverse = np.zeros_like(T_target_source)
    inverse[..., :3, :3] = rotation
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, T_target_source[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def relative_to_first(T_world_camera: Float64Array) -> Float64Array:
    """Camera poses [T, 4, 4] to `T_camera0_camera` [T, 4, 4]; the first is the identity, exactly."""
    relative = invert(T_world_camera[0]) @ T_world_camera
    relative[0] = np.eye(4)
    return relative


def transform_points(T_target_source: Float64Array, points_source: Float64Array) -> Float64Array:
    """Points [..., N, 3] of the source frame in the target frame."""
    rotation, translation = T_target_source[..., :3, :3], T_target_source[..., :3, 3]
    return points_source @ np.swapaxes(rotation, -1, -2) + translation[..., None, :]


def vectors_from_transforms(T_target_source: Float64Array) -> Float64Array:
    """Transforms [..., 4, 4] to xyz (m) and quaternion wxyz, w >= 0; float64 [..., 7]."""
    quaternion = quaternions_from_matrices(T_target_source[..., :3, :3])
    return np.concatenate([T_target_source[..., :3, 3], quaternion], axis=-1)


def transforms_from_vectors(vectors: Float64Array) -> Float64Array:
    """Inverse of `vectors_from_transforms`; [..., 7] to [..., 4, 4]."""
    vectors = np.asarray(vectors, np.float64)
    T = np.zeros((*vectors.shape[:-1], 4, 4))
    T[..., :3, :3] = matrices_from_quaternions(vectors[..., 3:])
    T[..., :3, 3] = vectors[..., :3]
    T[..., 3, 3] = 1.0
    return T


def rigidity_error(T_target_source: Float64Array) -> Float64Array:
    """How far 4 x 4 matrices [..., 4, 4] are from rigid: largest entry of |R^T R - I|, |det R - 1|, |last row - e4|.

    Infinite where an entry is not finite, so that comparing with a tolerance refuses such a matrix too.
    """
    finite = np.asarray(np.isfinite(T_target_source).all(axis=(-1, -2)))
    T = np.where(finite[..., None, None], T_target_source, np.eye(4))
    rotation = T[..., :3, :3]
    gram = np.abs(np.swapaxes(rotation, -1, -2) @ rotation - np.eye(3)).max(axis=(-1, -2))
    determinant = np.abs(np.linalg.det(rotation) - 1)
    last_row = np.abs(T[..., 3, :] - np.array([0.0, 0.0, 0.0, 1.0])).max(axis=-1)
    return np.where(finite, np.maximum(np.maximum(gram, determinant), last_row), np.inf)


def rotation_angle_rad(rotations: Float64Array) -> Float64Array:
    """Angle of rotation matrices [..., 3, 3], rad in [0, pi]; accurate for small angles too."""
    q = quaternions_from_matrices(rotations)
    return 2.0 * np.arctan2(np.linalg.norm(q[..., 1:], axis=-1), q[..., 0])
