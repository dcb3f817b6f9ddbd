"""Settings of `wsm posttrain`."""

from dataclasses import dataclass, field

from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.sources.queries import QueryConfig
from wsm_model.posttraining.config import PosttrainingConfig


@dataclass(frozen=True, kw_only=True)
class MeasuredConfig:
    """Queries that are measured before and after, of scenes that are not trained on.

    Attributes:
        split: split of their clips.
        queries: how many; 0: all, one a clip.
        seed: of which clips, latents and dreams.
    """

    split: str = "test"
    queries: int = 64
    seed: int = 1

    def __post_init__(self) -> None:
        if self.queries < 0:
            raise ValueError(f"queries must not be negative, found {self.queries}")


@dataclass(frozen=True, kw_only=True)
class PosttrainRunConfig:
    """Everything a run of post-training is made from.

    Attributes:
        model: folder of the pretrained model.
        source: release and selection that queries are taken from.
        order: which queries make up which step.
        read: how they are read.
        queries: which queries a clip has; `future_latents` is that of the session's chunk.
        posttraining: group, reward, objective, optimiser, checkpoints.
        measured: what is measured before and after.
        codec_weights: folder of the weights of the release's codec, where it has any; only for pictures.
    """

    model: str
    source: SourceConfig
    order: OrderConfig = field(default_factory=lambda: OrderConfig(global_batch=48))
    read: ReadConfig = field(default_factory=ReadConfig)
    queries: QueryConfig = field(default_factory=QueryConfig)
    posttraining: PosttrainingConfig = field(default_factory=PosttrainingConfig)
    measured: MeasuredConfig = field(default_factory=MeasuredConfig)
    codec_weights: str = ""

    def __post_init__(self) -> None:
        if not self.read.standardise:
            raise ValueError("read.standardise must be true: the model is made for standardised latents")
        if self.queries.future_latents != self.posttraining.session.chunk_size:
            raise ValueError(
                f"queries.future_latents must be the chunk that is dreamed, "
                f"posttraining.session.chunk_size = {self.posttraining.session.chunk_size}, found "
                f"{self.queries.future_latents}"
            )
        if self.measured.split in ("", self.source.split) and self.source.split:
            raise ValueError(
                f"measured.split must name clips that are not trained on, found {self.measured.split!r} for both"
            )
