"""Settings of pretraining; the defaults are those of the paper's table "Pretraining hyperparameters"."""

from dataclasses import dataclass, field

from wsm_model.losses.total import LossConfig
from wsm_model.precision import Precision


@dataclass(frozen=True, kw_only=True)
class OptimiserConfig:
    """AdamW with a linear warm-up and a cosine decay.

    Attributes:
        learning_rate: peak of the base learning rate.
        final_learning_rate: its value after the last step.
        generation_factor: what the generation expert and the goal embedding multiply it by.
        warmup_share: share of the steps in which it rises.
        beta_1: decay of the first moment.
        beta_2: decay of the second moment.
        eps: added to the root of the second moment.
        weight_decay: decoupled.
        decay_vectors: whether norms, biases and tables of modulation decay too, as everything does in the paper, which
            names no exception; otherwise matrices alone.
        clip_norm: largest norm of the gradient of all parameters.
    """

    learning_rate: float = 3e-5
    final_learning_rate: float = 3e-6
    generation_factor: float = 0.3
    warmup_share: float = 0.05
    beta_1: float = 0.9
    beta_2: float = 0.95
    eps: float = 1e-8
    weight_decay: float = 0.01
    decay_vectors: bool = True
    clip_norm: float = 2.0

    def __post_init__(self) -> None:
        if not 0 < self.final_learning_rate <= self.learning_rate:
            raise ValueError(
                f"final_learning_rate must lie in (0, learning_rate = {self.learning_rate}], found "
                f"{self.final_learning_rate}"
            )
        if not 0 <= self.warmup_share < 1:
            raise ValueError(f"warmup_share must lie in [0, 1), found {self.warmup_share}")
        for name in ("beta_1", "beta_2"):
            if not 0 <= getattr(self, name) < 1:
                raise ValueError(f"{name} must lie in [0, 1), found {getattr(self, name)}")
        for name in ("generation_factor", "eps", "weight_decay"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")
        if not self.clip_norm > 0:
            raise ValueError(f"clip_norm must be above 0, or no step would change anything, found {self.clip_norm}")


@dataclass(frozen=True, kw_only=True)
class LoopConfig:
    """How long a run trains, how fast, and how often it tells and keeps where it stands.

    Attributes:
        epochs: passes over the data.
        max_steps: end after this many optimiser steps; 0: after `epochs`. The schedule ends where training ends.
        optimiser: learning rate and moments.
        checkpoint_every: optimiser steps between checkpoints; there is one at the end in any case.
        keep_checkpoints: how many of the latest stay on disk.
        log_every: optimiser steps between lines of metrics.
        sample_every: optimiser steps between pictures; 0: none.
        evaluate_every: optimiser steps between evaluations on all held-out clips, beside that at the end; 0: none.
    """

    epochs: int = 10
    max_steps: int = 0
    optimiser: OptimiserConfig = field(default_factory=OptimiserConfig)
    checkpoint_every: int = 500
    keep_checkpoints: int = 2
    log_every: int = 1
    sample_every: int = 0
    evaluate_every: int = 0

    def __post_init__(self) -> None:
        for name in ("epochs", "checkpoint_every", "keep_checkpoints", "log_every"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")
        for name in ("max_steps", "sample_every", "evaluate_every"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True)
class TrainingConfig(LoopConfig):
    """How a model is pretrained.

    Attributes:
        micro_rows: rows of a rank's step that are passed at once; gradients of the parts are accumulated. 0: all.
        seed: of initial weights, noise and flow times.
        precision: arithmetic of matrix products.
        checkpoint_activations: recompute each layer in the backward pass instead of keeping what is inside it.
        shard_ranks: ranks that weights, gradients and moments are sharded over, such as those of one machine; groups of
            so many hold copies of one another. 0: all ranks.
        compile: whether blocks are compiled, which takes a minute or two and saves time in every step.
        profile_steps: steps of which a trace is recorded on the first rank, after three that are not; 0: none.
        depth_noise: largest share s of noise eps in the depth latents d that later chunks see: of each sequence a
            share is drawn uniformly up to it, and they see (1 - s) d + s eps. In use they see estimates, which are not
            the truth (paper silent; 0: the truth, its teacher forcing).
        rgb_noise: largest share of noise in the clean RGB latents, likewise, in some of the sequences. With 0.5 it is
            the noisy history of LingBot-VA, whose dreams may stop half denoised (paper silent; 0: the truth).
        rgb_noise_probability: that a sequence has noise in its RGB (LingBot-VA: 0.5).
        ema_decay: decay of an average of the weights over the steps, such as 0.999: it is what is measured, drawn and
            exported (paper silent; 0: none is kept).
        loss: weights of the parts.
    """

    micro_rows: int = 0
    seed: int = 0
    precision: Precision = Precision.BFLOAT16
    checkpoint_activations: bool = False
    shard_ranks: int = 0
    compile: bool = False
    profile_steps: int = 0
    depth_noise: float = 0.0
    rgb_noise: float = 0.0
    rgb_noise_probability: float = 0.5
    ema_decay: float = 0.0
    loss: LossConfig = field(default_factory=LossConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.ema_decay < 1:
            raise ValueError(f"ema_decay must lie in [0, 1), found {self.ema_decay}")
        for name in ("depth_noise", "rgb_noise", "rgb_noise_probability"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} must lie in [0, 1], found {getattr(self, name)}")
        for name in ("micro_rows", "seed", "profile_steps", "shard_ranks"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")
