"""Shape of the World SLAM Model.

The paper fixes the full size (section 3.2 and appendix B.1, "Architecture"); what it leaves open is decided here, and
each such field says "paper silent".
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from wsm_data.schema.sequence import POSE_SLOTS


class Expert(StrEnum):
    """The three transformers that share one self-attention (paper, section 3.2)."""

    GENERATION = "generation"
    DEPTH = "depth"
    POSE = "pose"


class Variant(StrEnum):
    """The full model, or the paper's ablation without SLAM (section 4.4)."""

    SLAM = "slam"
    IDM = "idm"


class Prediction(StrEnum):
    """What the RGB head says of noisy latents; the loss is that of the velocity in either."""

    VELOCITY = "velocity"
    CLEAN = "clean"


@dataclass(frozen=True, kw_only=True)
class ExpertConfig:
    """Widths of one expert.

    Attributes:
        width: D, of its tokens.
        feed_forward_width: of the hidden layer of its feed-forward network.
    """

    width: int
    feed_forward_width: int

    def __post_init__(self) -> None:
        if self.width < 2 or self.width % 2 or self.feed_forward_width < 1:
            raise ValueError(f"an expert must have an even width and a feed-forward width of at least 1, found {self}")


@dataclass(frozen=True, kw_only=True)
class ModelConfig:
    """Everything that decides the shapes of the weights and what they compute.

    Attributes:
        generation: expert of the RGB tokens.
        depth: expert of the depth tokens.
        pose: expert of the pose tokens.
        layers: transformer layers, the same number in every expert.
        heads: H, attention heads, the same in every expert: they attend to one another (paper silent).
        head_width: d, width of a head.
        latent_channels: C, channels of an RGB or depth latent.
        latent_height: h, rows of a latent.
        latent_width: w, columns of a latent.
        patch: side of a patch, in latent cells.
        pose_slots: M, raw frames and poses of a latent frame.
        time_frequencies: width of the sinusoid of a timestep.
        rope_theta: base of the rotary frequencies.
        norm_eps: added to the variance in every norm.
        goal_frequencies: Fourier frequencies of a goal coordinate, 2^0 to 2^(n-1) times `goal_base_rad_per_m` (paper
            silent).
        goal_base_rad_per_m: lowest of those frequencies: half a turn in 32 m, beyond the longest episodes (paper
            silent).
        goal_tokens: S, tokens that predictions attend to across. The goal is one; with more, as Wan2.2's text has, the
            cross-attention has queries, keys and their norms too.
        pose_hidden: width of the pose head's hidden layer (paper silent).
        clean_state_time: timestep that clean states are modulated with (paper silent).
        state_query_time: timestep that state queries are modulated with (paper silent).
        variant: the full model, or the ablation without SLAM.
        prediction: `velocity` (the paper), or `clean`, from which it follows (`wsm_model.flow.velocity_of`).
        own_dream_attention: whether the generation expert asks, answers and gathers for the RGB it dreams with matrices
            of their own, as after post-training: what was seen passes through those of pretraining, so that the SLAM
            expert, which reads it, says what it said to the bit.
    """

    generation: ExpertConfig
    depth: ExpertConfig
    pose: ExpertConfig
    layers: int
    heads: int
    head_width: int
    latent_channels: int = 48
    latent_height: int = 12
    latent_width: int = 20
    patch: int = 2
    pose_slots: int = POSE_SLOTS
    time_frequencies: int = 256
    rope_theta: float = 10000.0
    norm_eps: float = 1e-6
    goal_frequencies: int = 10
    goal_base_rad_per_m: float = 0.09817477042468103
    goal_tokens: int = 1
    pose_hidden: int = 768
    clean_state_time: float = 0.0
    state_query_time: float = 1000.0
    variant: Variant = Variant.SLAM
    prediction: Prediction = Prediction.VELOCITY
    own_dream_attention: bool = False

    def __post_init__(self) -> None:
        if self.latent_height % self.patch or self.latent_width % self.patch:
            raise ValueError(
                f"latents of {self.latent_height} x {self.latent_width} cells cannot be cut into patches of "
                f"{self.patch} x {self.patch}"
            )
        if self.head_width % 2 or self.head_width < 6:
            raise ValueError(f"head_width must be even and at least 6 for rotary positions, found {self.head_width}")
        if self.time_frequencies % 2:
            raise ValueError(f"time_frequencies must be even, found {self.time_frequencies}")
        for name in ("layers", "heads", "pose_slots", "goal_frequencies", "goal_tokens", "pose_hidden"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")

    @property
    def experts(self) -> tuple[Expert, ...]:
        """The experts that the variant has."""
        has_depth = self.variant is Variant.SLAM
        return (Expert.GENERATION, Expert.DEPTH, Expert.POSE) if has_depth else (Expert.GENERATION, Expert.POSE)

    @property
    def state_experts(self) -> tuple[Expert, ...]:
        """The experts of metric states, in the order of their tokens."""
        return self.experts[1:]

    @property
    def attention_width(self) -> int:
        """H d, width of queries, keys and values of every expert."""
        return self.heads * self.head_width

    @property
    def patches(self) -> int:
        """Tokens of an RGB or depth latent."""
        return (self.latent_height // self.patch) * (self.latent_width // self.patch)

    @property
    def patch_values(self) -> int:
        """Values of a patch."""
        return self.latent_channels * self.patch**2

    @property
    def tokens(self) -> Mapping[Expert, int]:
        """P, tokens of one latent frame in each expert, for one copy of it."""
        sizes = {Expert.GENERATION: self.patches, Expert.DEPTH: self.patches, Expert.POSE: self.pose_slots}
        return MappingProxyType({expert: sizes[expert] for expert in self.experts})

    def expert(self, expert: Expert) -> ExpertConfig:
        """Widths of an expert."""
        return {Expert.GENERATION: self.generation, Expert.DEPTH: self.depth, Expert.POSE: self.pose}[expert]
