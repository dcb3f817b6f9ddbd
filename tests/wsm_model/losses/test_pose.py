"""Pose losses against loops over frames and pairs with matrices, and what they must not depend on."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.geometry.quaternion import matrices_from_quaternions, quaternions_from_matrices
from wsm_model.losses.pose import pose_losses, raw_frame_poses, relative_poses

DELTA = 0.1


def huber(difference: np.ndarray) -> float:
    """Mean smooth L1 with beta = 0.1: quadratic below, |x| - beta / 2 above (torch's definition)."""
    size = np.abs(difference)
    return float(np.where(size < DELTA, size**2 / (2 * DELTA), size - DELTA / 2).mean())


def distance(predicted: np.ndarray, target: np.ndarray) -> float:
    """Norm of one pose difference; of q and -q the nearer one counts."""
    rotation = predicted[3:] if predicted[3:] @ target[3:] >= 0 else -predicted[3:]
    return huber(predicted[:3] - target[:3]) + huber(rotation - target[3:])


def relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pose a^-1 b by 4 x 4 matrices in float64."""
    matrices = []
    for pose in (a, b):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = matrices_from_quaternions(pose[3:]), pose[:3]
        matrices.append(matrix)
    found = np.linalg.inv(matrices[0]) @ matrices[1]
    return np.concatenate([found[:3, 3], quaternions_from_matrices(found[:3, :3])])


def test_losses_equal_the_means_over_frames_and_ordered_pairs(make_poses):
    torch.manual_seed(0)
    predicted, target = make_poses(6).double(), make_poses(6).double()
    absolute = np.mean([distance(*pair) for pair in zip(predicted.numpy(), target.numpy(), strict=True)])
    pairs = [
        distance(relative(predicted[i].numpy(), predicted[j].numpy()), relative(target[i].numpy(), target[j].numpy()))
        for i in range(6)
        for j in range(6)
        if i != j
    ]
    found = pose_losses(predicted, target, DELTA)
    assert np.isclose(float(found.absolute), absolute, rtol=1e-9)
    assert np.isclose(float(found.relative), np.mean(pairs), rtol=1e-9)


@given(st.lists(st.booleans(), min_size=5, max_size=5), st.lists(st.booleans(), min_size=5, max_size=5))
def test_the_sign_of_a_quaternion_changes_nothing(flip_predicted, flip_target):
    generator = torch.Generator().manual_seed(3)
    poses = torch.randn(2, 5, 7, generator=generator, dtype=torch.float64)
    poses[..., 3:] /= poses[..., 3:].norm(dim=-1, keepdim=True)
    flipped = poses.clone()
    for side, flips in enumerate((flip_predicted, flip_target)):
        flipped[side, torch.tensor(flips), 3:] *= -1
    wanted, found = pose_losses(*poses, DELTA), pose_losses(*flipped, DELTA)
    torch.testing.assert_close(found.absolute, wanted.absolute)
    torch.testing.assert_close(found.relative, wanted.relative)


def test_relative_poses_do_not_change_when_the_whole_path_is_moved(make_poses):
    torch.manual_seed(1)
    path, motion = make_poses(5).double(), make_poses(1).double()[0].numpy()
    inverse = relative(motion, np.array([0.0, 0, 0, 1, 0, 0, 0]))
    moved = torch.from_numpy(np.stack([relative(inverse, pose) for pose in path.numpy()]))
    first, second = relative_poses(path), relative_poses(moved)
    # Quaternions of unit length to float32's rounding alone: matrices made of them are rigid to 1e-7 only.
    torch.testing.assert_close(first[..., :3], second[..., :3], rtol=0, atol=2e-6)
    same_turn = (first[..., 3:] * second[..., 3:]).sum(-1).abs()
    torch.testing.assert_close(same_turn, torch.ones_like(same_turn), rtol=0, atol=2e-6)


def test_the_truth_costs_nothing_and_a_single_frame_has_no_pairs(make_poses):
    poses = make_poses(4)
    assert [float(loss) for loss in pose_losses(poses, poses, DELTA)] == [0.0, 0.0]
    assert float(pose_losses(make_poses(1), poses[:1], DELTA).relative) == 0.0


def test_the_four_slots_of_the_anchor_count_as_one_frame():
    slots = torch.arange(3 * 4).reshape(3, 4, 1).expand(3, 4, 7).float()
    assert raw_frame_poses(slots)[:, 0].tolist() == [3, 4, 5, 6, 7, 8, 9, 10, 11]
