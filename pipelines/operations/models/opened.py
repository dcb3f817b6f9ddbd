"""A trained model opened for the clips of a release, and the settings of what is done with it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch

from pipelines.running.settings import merge, parse_assignments
from pipelines.training.config import HeldOutConfig
from pipelines.training.data import decoding_of
from wsm_data.access.release import Release
from wsm_data.files.typed_toml import build_config
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.evaluation.decoding import Decoding
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import ModelCard, load_model


@dataclass(frozen=True, kw_only=True)
class OpenedModel:
    """A model where it runs.

    Attributes:
        model: in evaluation mode.
        card: what its file says.
        decoding: of the release.
        device: cuda where there is one.
    """

    model: WorldSlamModel
    card: ModelCard
    decoding: Decoding
    device: torch.device

    @property
    def needs_depth(self) -> bool:
        """Whether its clips must have depth."""
        return self.card.config.variant is Variant.SLAM


def open_model(folder: Path, release: Release, codec_weights: str) -> OpenedModel:
    """Open a model for a release.

    Raises:
        ConfigError: there is no model, it was trained on latents of another codec or other statistics, or the codec
            cannot be built.
        IntegrityError: its files are damaged.
    """
    model, card = load_model(folder, latent_standard(release.manifest))
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    decoding = decoding_of(release.manifest, codec_weights)
    return OpenedModel(model=model.to(device), card=card, decoding=decoding, device=device)


def held_out_config(assignments: Sequence[str], options: Mapping[str, object]) -> HeldOutConfig:
    """Settings of a measurement: those of `held_out` of training; what an option says stands.

    Raises:
        ConfigError: there is no such setting, or its value is wrong.
    """
    return build_config(HeldOutConfig, merge(parse_assignments(assignments), options), "held_out")
