"""Camera poses to pose tokens and back.

A pose is [7]: translation in the first camera's frame (m), then a unit quaternion wxyz. The paper gives the pose expert
tokens and a head; the embedding of translation and rotation matrix, and the head's two layers, are decided here.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional

from wsm_data.schema.pose import IDENTITY_POSE, POSE_VALUES
from wsm_model.layers.modulation import modulated_norm


def rotation_matrices(quaternions: Tensor) -> Tensor:
    """Unit quaternions wxyz [..., 4] to rotation matrices [..., 3, 3]."""
    w, x, y, z = quaternions.unbind(-1)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


def identity_poses(*shape: int, device: torch.device | None = None) -> Tensor:
    """Identity poses, float32 [*shape, 7]: what state queries ask with."""
    return torch.tensor(IDENTITY_POSE, device=device).expand(*shape, POSE_VALUES)


class PoseEmbedding(nn.Module):
    """Poses [..., 7] to tokens [..., D]: one Linear of translation (m) and the row-major rotation matrix; float32.

    Rounded to bfloat16, a translation of 10 m would be off by up to 3 cm.

    Args:
        width: D.
    """

    def __init__(self, width: int):
        super().__init__()
        self.linear = nn.Linear(12, width)

    def forward(self, poses: Tensor) -> Tensor:
        """Embed poses."""
        with torch.autocast(poses.device.type, enabled=False):
            poses = poses.float()
            values = torch.cat([poses[..., :3], rotation_matrices(poses[..., 3:]).flatten(-2)], dim=-1)
            return functional.linear(values, *_float(self.linear))


class PoseHead(nn.Module):
    """Tokens [..., D] to poses [..., 7] with unit quaternions; float32. Before training it says identity.

    Args:
        width: D.
        hidden: width of the hidden layer.
        eps: added to the variance of the norm.
    """

    def __init__(self, width: int, hidden: int, eps: float):
        super().__init__()
        self.eps = eps
        self.table = nn.Parameter(torch.zeros(2, width))
        self.linear_1 = nn.Linear(width, hidden)
        self.linear_2 = nn.Linear(hidden, POSE_VALUES)
        self.reset_parameters()

    def reset_parameters(self) -> None:
        """Say identity whatever the token: weights zero, bias the identity pose."""
        nn.init.normal_(self.table, std=self.table.shape[-1] ** -0.5)
        nn.init.zeros_(self.linear_2.weight)
        with torch.no_grad():
            self.linear_2.bias.copy_(torch.tensor(IDENTITY_POSE))

    def forward(self, x: Tensor, time: Tensor) -> Tensor:
        """Read poses from tokens; `time` is the time embedding e, broadcastable to x."""
        with torch.autocast(x.device.type, enabled=False):
            shift, scale = (self.table.float() + time.unsqueeze(-2)).unbind(-2)
            hidden = functional.silu(
                functional.linear(modulated_norm(x.float(), shift, scale, self.eps), *_float(self.linear_1))
            )
            values = functional.linear(hidden, *_float(self.linear_2))
            return torch.cat([values[..., :3], functional.normalize(values[..., 3:], dim=-1)], dim=-1)


def _float(linear: nn.Linear) -> tuple[Tensor, Tensor]:
    return linear.weight.float(), linear.bias.float()
