"""The objective of DiffusionNFT for dreams (paper, appendix B.2; spec/model.md, section 8).

Shape suffixes: G dreams, K latent frames, C channels, h rows and w columns of a latent.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

_FLOOR = 1e-5
"""Least normaliser of a branch."""


@dataclass(frozen=True, kw_only=True)
class ObjectiveConfig:
    """Weights of the objective; the defaults are the paper's.

    Attributes:
        beta: how far the implicit policies lie from the old one.
        advantage_max: A_max, where advantages are clipped.
        reference: lambda_ref, weight of the distance to the pretrained model.
        flow_times: flow times that are drawn for each dream, no two alike.
    """

    beta: float = 0.1
    advantage_max: float = 5.0
    reference: float = 1e-4
    flow_times: int = 4

    def __post_init__(self) -> None:
        if not (self.beta > 0 and self.advantage_max > 0 and self.reference >= 0):
            raise ValueError(f"beta and advantage_max must be above 0, reference not below, found {self}")
        if self.flow_times < 1:
            raise ValueError(f"flow_times must be at least 1, found {self.flow_times}")


@dataclass(frozen=True, kw_only=True)
class Velocities:
    """What three policies say of the same noisy dreams, [G, K, C, h, w].

    Attributes:
        trained: v, with gradients.
        old: v_old, which the dreams were sampled from.
        reference: v_ref, the pretrained model.
    """

    trained: Tensor
    old: Tensor
    reference: Tensor


@dataclass(frozen=True, kw_only=True)
class ObjectiveTerms:
    """The loss and its parts, means over the dreams.

    Attributes:
        loss: what is minimised.
        positive: squared error of the positive branch, normalised, without its weight.
        negative: of the negative branch.
        reference: mean squared distance to the pretrained velocity.
    """

    loss: Tensor
    positive: Tensor
    negative: Tensor
    reference: Tensor


def nft_loss(
    velocities: Velocities,
    dream_GKChw: Tensor,
    noisy_GKChw: Tensor,
    flow_time_G: Tensor,
    rho_G: Tensor,
    config: ObjectiveConfig,
) -> ObjectiveTerms:
    """The loss of dreams at one flow time each.

    v+ = (1 - beta) v_old + beta v, v- = (1 + beta) v_old - beta v; each gives x = x_tau - tau v, whose squared error to
    the dream is divided by its mean absolute error (no gradient, at least 1e-5). The branches weigh rho and 1 - rho,
    and both A_max / beta, as in the public code, with which lambda_ref was set.

    Args:
        velocities: of the three policies.
        dream_GKChw: x_0, the clean dreams.
        noisy_GKChw: x_tau = (1 - tau) x_0 + tau eps.
        flow_time_G: tau of each dream.
        rho_G: optimality probability of each.
        config: weights.
    """
    tau = flow_time_G.view(-1, *[1] * (dream_GKChw.dim() - 1))
    beta, old = config.beta, velocities.old.float()
    trained = velocities.trained.float()
    branches = [
        _normalised(noisy_GKChw - tau * velocity, dream_GKChw)
        for velocity in ((1 - beta) * old + beta * trained, (1 + beta) * old - beta * trained)
    ]
    rho = rho_G.to(branches[0])
    policy = config.advantage_max * ((rho * branches[0] + (1 - rho) * branches[1]) / beta).mean()
    reference = ((trained - velocities.reference.float()) ** 2).mean()
    return ObjectiveTerms(
        loss=policy + config.reference * reference,
        positive=branches[0].detach().mean(),
        negative=branches[1].detach().mean(),
        reference=reference.detach(),
    )


def _normalised(found: Tensor, wanted: Tensor) -> Tensor:
    """Squared error of each dream over its own mean absolute error; [G]."""
    over = tuple(range(1, wanted.dim()))
    with torch.no_grad():
        scale = (found.double() - wanted.double()).abs().mean(dim=over).clamp(min=_FLOOR)
    return ((found - wanted) ** 2).mean(dim=over) / scale.to(found.dtype)
