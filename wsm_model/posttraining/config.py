"""Settings of post-training; the defaults are those of the paper's table "Post-training hyperparameters"."""

from dataclasses import dataclass, field

from wsm_model.inference.session import SessionConfig
from wsm_model.posttraining.advantages import Spread
from wsm_model.posttraining.objective import ObjectiveConfig
from wsm_model.posttraining.reward import RewardConfig
from wsm_model.training.config import LoopConfig, OptimiserConfig


@dataclass(frozen=True, kw_only=True)
class AdapterConfig:
    """Size of the adapters (paper: rank 32, alpha 64, on q, k, v and o of the generation expert's self-attention).

    Attributes:
        rank: of the two matrices of each adapter.
        alpha: their product is scaled by alpha / rank.
    """

    rank: int = 32
    alpha: int = 64

    def __post_init__(self) -> None:
        if self.rank < 1 or self.alpha < 1:
            raise ValueError(f"rank and alpha must be at least 1, found {self.rank} and {self.alpha}")


@dataclass(frozen=True, kw_only=True)
class OldPolicyConfig:
    """How the old policy, which dreams, follows the trained one.

    Attributes:
        decay_per_step: its decay is this times the steps done,
        most: at most (spec/model.md 8: min(0.001 step, 0.5)).
        each_epoch: follow at the end of an epoch (DiffusionNFT); otherwise after each step.
    """

    decay_per_step: float = 0.001
    most: float = 0.5
    each_epoch: bool = False

    def __post_init__(self) -> None:
        if self.decay_per_step < 0 or not 0 <= self.most < 1:
            raise ValueError(f"decay_per_step must not be negative, most lie in [0, 1), found {self}")


@dataclass(frozen=True, kw_only=True)
class PosttrainingConfig(LoopConfig):
    """How a model is post-trained.

    Attributes:
        epochs: passes over the queries.
        optimiser: learning rate and moments.
        group: G, dreams of a query.
        flow_steps: sampler steps of a dream; flow times are drawn from those of the sampler.
        flow_shift: gamma of the sampler.
        seed: of adapters, dreams and flow times.
        spread: over what the standard deviation of rewards is taken.
        adapters: rank and alpha.
        reward: temperature and bonus.
        objective: beta, A_max, lambda_ref and flow times.
        old_policy: how it follows.
        session: chunk size, which is K, cache and backend.
    """

    epochs: int = 1
    optimiser: OptimiserConfig = field(
        default_factory=lambda: OptimiserConfig(
            warmup_share=0.03, beta_2=0.999, weight_decay=1e-4, clip_norm=1.0, generation_factor=1.0
        )
    )
    group: int = 16
    flow_steps: int = 8
    flow_shift: float = 5.0
    seed: int = 0
    spread: Spread = Spread.GROUP
    adapters: AdapterConfig = field(default_factory=AdapterConfig)
    reward: RewardConfig = field(default_factory=RewardConfig)
    objective: ObjectiveConfig = field(default_factory=ObjectiveConfig)
    old_policy: OldPolicyConfig = field(default_factory=OldPolicyConfig)
    session: SessionConfig = field(default_factory=SessionConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.group < 2:
            raise ValueError(f"a group must have at least 2 dreams, or none is better than another, found {self.group}")
        if not 1 <= self.objective.flow_times <= self.flow_steps:
            raise ValueError(
                f"objective.flow_times must lie between 1 and flow_steps = {self.flow_steps}, since they are drawn "
                f"without repeats, found {self.objective.flow_times}"
            )
