"""Settings of `wsm train`."""

from dataclasses import dataclass, field

from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_model.config import Prediction, Variant
from wsm_model.inference.session import SessionConfig
from wsm_model.model import Attention
from wsm_model.training.budget import HardwareConfig
from wsm_model.training.config import TrainingConfig


@dataclass(frozen=True, kw_only=True)
class ModelChoice:
    """Which model is trained.

    Attributes:
        size: `tiny`, `small` or `wsm5b`.
        variant: `slam`, or `idm` for the ablation without SLAM.
        prediction: `velocity` or `clean`: what the RGB head says of noisy latents; `none`: that of the size.
        weights: folder of the transformer of Wan2.2-TI2V-5B to start from; empty: from random weights.
        init: folder of a model of this project, of a run, or of a checkpoint, whose weights are started from.
        attention: how the joint attention is evaluated: `auto`, `flex`, `blocks` or `dense`.
    """

    size: str = "tiny"
    variant: Variant = Variant.SLAM
    prediction: Prediction | None = None
    weights: str = ""
    init: str = ""
    attention: Attention = Attention.AUTO

    def __post_init__(self) -> None:
        if self.weights and self.init:
            raise ValueError("a run starts from `weights` or from `init`, not from both: leave one of them empty")


@dataclass(frozen=True, kw_only=True)
class HeldOutConfig:
    """What is measured and drawn on clips that are not trained on.

    Attributes:
        split: split of those clips.
        clips: clips that are evaluated after the last step; 0: none.
        sampled_clips: clips that are measured with every picture, for the curves; the first of them is drawn.
        max_latents: they are cut to prefixes of this length; 0: whole clips.
        flow_steps: sampler steps of a dream (paper: 8).
        session: chunk size, cache and backend of the streaming estimation.
    """

    split: str = "test"
    clips: int = 16
    sampled_clips: int = 4
    max_latents: int = 0
    flow_steps: int = 8
    session: SessionConfig = field(default_factory=SessionConfig)

    def __post_init__(self) -> None:
        if self.clips < 0 or self.flow_steps < 1 or self.sampled_clips < 1:
            raise ValueError(
                "clips must not be negative, flow_steps and sampled_clips be at least 1, found "
                f"{self.clips}, {self.flow_steps} and {self.sampled_clips}"
            )
        if self.max_latents < 0 or self.max_latents == 1:
            raise ValueError(
                f"max_latents must be 0, or leave a latent after the anchor: at least 2, found {self.max_latents}"
            )


@dataclass(frozen=True, kw_only=True)
class TrainRunConfig:
    """Everything a training run is made from.

    Attributes:
        sources: releases and selections that are trained on.
        order: which clips make up which step.
        read: how they are read.
        model: which model.
        training: optimiser, losses, checkpoints.
        held_out: what is measured on other clips.
        hardware: what `--dry-run` plans for.
        codec_weights: folder of the weights of the release's codec, where it has any; only for pictures.
    """

    sources: tuple[SourceConfig, ...]
    order: OrderConfig = field(default_factory=lambda: OrderConfig(global_batch=48))
    read: ReadConfig = field(default_factory=ReadConfig)
    model: ModelChoice = field(default_factory=ModelChoice)
    training: TrainingConfig = field(default_factory=TrainingConfig)
    held_out: HeldOutConfig = field(default_factory=HeldOutConfig)
    hardware: HardwareConfig = field(default_factory=HardwareConfig)
    codec_weights: str = ""

    def __post_init__(self) -> None:
        if not self.read.standardise:
            raise ValueError("read.standardise must be true: the model is made for standardised latents")
        split = self.held_out.split
        of_held_out = [one for one in self.sources if one.release == self.sources[0].release]
        if any(one.split == split or not (one.split or one.selection) for one in of_held_out):
            raise ValueError(
                f"held_out.split must name clips that are not trained on, but a source trains on the split {split!r} "
                f"of {self.sources[0].release}; name another split for one of the two"
            )
