"""Absolute and pairwise relative poses under the smooth-L1 norm (paper, appendix A.1, "Camera pose").

A pose [7] is xyz (m) and a unit quaternion wxyz in the first camera's frame. q and -q are the same rotation:
predictions are flipped to the target's hemisphere before they are compared (paper silent). The norm is the mean over
the three coordinates plus the mean over the four components (paper silent).

Shape suffixes: T raw frames.
"""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from wsm_model.layers.pose import rotation_matrices


class PoseLosses(NamedTuple):
    """Scalars."""

    absolute: Tensor
    relative: Tensor


def raw_frame_poses(slots_FM7: Tensor) -> Tensor:
    """Poses of the unique raw frames [T, 7] from slots [F, M, 7]: latent 0 stands for one frame, later ones for M."""
    return slots_FM7.flatten(0, 1)[slots_FM7.shape[1] - 1 :]


def pose_losses(predicted_T7: Tensor, target_T7: Tensor, delta: float) -> PoseLosses:
    """Losses of one sequence.

    Args:
        predicted_T7: float32; unit quaternions of either sign.
        target_T7: likewise.
        delta: where the norm turns from square to absolute value (beta of torch's smooth_l1_loss).

    Returns:
        The mean over frames, and the mean over all ordered pairs of different frames; 0 for a single frame.
    """
    absolute = _norm(predicted_T7, target_T7, delta).mean()
    frames = len(target_T7)
    if frames < 2:
        return PoseLosses(absolute, torch.zeros_like(absolute))
    pairs = _norm(relative_poses(predicted_T7), relative_poses(target_T7), delta)
    return PoseLosses(absolute, pairs.sum() / (frames * (frames - 1)))  # a frame against itself adds 0


def relative_poses(poses_T7: Tensor) -> Tensor:
    """g_i^-1 g_j of all pairs, [T, T, 7]."""
    translation, quaternion = poses_T7[:, :3], poses_T7[:, 3:]
    apart = translation[None, :] - translation[:, None]
    turned = torch.einsum("iba,ijb->ija", rotation_matrices(quaternion), apart)
    return torch.cat([turned, _conjugate_product(quaternion)], dim=-1)


def _conjugate_product(q_T4: Tensor) -> Tensor:
    """conj(q_i) q_j of all pairs, [T, T, 4]."""
    (a, b, c, d), (w, x, y, z) = (side.unbind(-1) for side in (q_T4[:, None], q_T4[None, :]))
    b, c, d = -b, -c, -d
    return torch.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ],
        dim=-1,
    )


def _norm(predicted: Tensor, target: Tensor, delta: float) -> Tensor:
    """Of each pose: mean over translation plus mean over the sign-aligned quaternion."""
    opposite = (predicted[..., 3:] * target[..., 3:]).sum(-1, keepdim=True) < 0
    rotation = torch.where(opposite, -predicted[..., 3:], predicted[..., 3:])
    return smooth_l1_loss(predicted[..., :3], target[..., :3], reduction="none", beta=delta).mean(-1) + smooth_l1_loss(
        rotation, target[..., 3:], reduction="none", beta=delta
    ).mean(-1)
