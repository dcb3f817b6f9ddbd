"""Named sizes of the model."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import did_you_mean
from wsm_model.config import ExpertConfig, ModelConfig, Prediction, Variant

PRESETS: Mapping[str, ModelConfig] = MappingProxyType(
    {
        "tiny": ModelConfig(
            generation=ExpertConfig(width=192, feed_forward_width=512),
            depth=ExpertConfig(width=128, feed_forward_width=384),
            pose=ExpertConfig(width=128, feed_forward_width=384),
            layers=6,
            heads=6,
            head_width=32,
            pose_hidden=128,
            prediction=Prediction.CLEAN,
        ),
        "small": ModelConfig(
            generation=ExpertConfig(width=768, feed_forward_width=2048),
            depth=ExpertConfig(width=384, feed_forward_width=1024),
            pose=ExpertConfig(width=192, feed_forward_width=512),
            layers=10,
            heads=12,
            head_width=64,
            pose_hidden=192,
        ),
        "wsm5b": ModelConfig(
            generation=ExpertConfig(width=3072, feed_forward_width=14336),
            depth=ExpertConfig(width=1536, feed_forward_width=7168),
            pose=ExpertConfig(width=768, feed_forward_width=3584),
            layers=30,
            heads=24,
            head_width=128,
        ),
    }
)
"""`tiny` learns on a CPU, `small` on one GPU, `wsm5b` is the paper's size (its "Architecture" paragraph)."""


def preset(
    name: str, *, latent_height: int = 12, latent_width: int = 20, variant: Variant = Variant.SLAM
) -> ModelConfig:
    """The configuration of a named size for latents of `latent_height` x `latent_width` cells.

    Raises:
        ConfigError: there is no such size.
        ValueError: the latents cannot be cut into patches.
    """
    if name not in PRESETS:
        raise ConfigError(f"there is no model size {name!r}; {did_you_mean(name, PRESETS)}")
    return replace(PRESETS[name], latent_height=latent_height, latent_width=latent_width, variant=variant)
