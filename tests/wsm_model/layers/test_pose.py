"""Poses to tokens and back."""

import numpy as np
import torch

from wsm_data.geometry.quaternion import matrices_from_quaternions
from wsm_model.layers.pose import PoseEmbedding, PoseHead, identity_poses, rotation_matrices


def test_rotation_matrices_are_those_of_the_data_library(make_poses):
    poses = make_poses(20).double()
    wanted = matrices_from_quaternions(poses[:, 3:].numpy())
    np.testing.assert_allclose(rotation_matrices(poses[:, 3:]).numpy(), wanted, atol=1e-6)  # unit to float32 only


def test_a_pose_and_its_negative_quaternion_have_one_token(make_poses):
    torch.manual_seed(0)
    embedding, poses = PoseEmbedding(8), make_poses(5)
    flipped = poses.clone()
    flipped[:, 3:] *= -1
    torch.testing.assert_close(embedding(flipped), embedding(poses))


def test_the_head_says_identity_before_training_whatever_the_token():
    head = PoseHead(16, 12, 1e-6)
    assert torch.equal(head(torch.randn(3, 16), torch.randn(3, 16)), identity_poses(3))


def test_the_head_gives_unit_quaternions_in_float32_under_autocast():
    torch.manual_seed(0)
    head = PoseHead(16, 12, 1e-6)
    torch.nn.init.normal_(head.linear_2.weight)
    with torch.autocast("cpu", torch.bfloat16):
        poses = head(torch.randn(9, 16).bfloat16(), torch.randn(9, 16))
    assert poses.dtype == torch.float32
    torch.testing.assert_close(poses[:, 3:].norm(dim=-1), torch.ones(9))
