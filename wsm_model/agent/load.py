"""An agent from a model file."""

from pathlib import Path

import torch

from wsm_data.codecs.registry import CodecConfig, make_codec
from wsm_data.errors import ConfigError
from wsm_model.agent.agent import Agent, Watcher
from wsm_model.agent.config import AgentConfig
from wsm_model.agent.eye import Eye
from wsm_model.model_file import load_card, load_model


def load_agent(
    folder: Path, config: AgentConfig, *, codec_weights: str = "", device: str = "", watcher: Watcher | None = None
) -> Agent:
    """Read a model and build its codec.

    Args:
        folder: of the model.
        config: settings of the agent.
        codec_weights: folder of the weights of the model's codec, where it has any.
        device: where the model runs; empty: cuda where there is one.
        watcher: is shown the dreams.

    Raises:
        ConfigError: there is no model, or this codec is not the one that it was trained on.
        IntegrityError: its files are damaged.
    """
    standard = load_card(folder).standard
    codec = make_codec(CodecConfig(name=standard.codec, weights=codec_weights))
    found = codec.describe().digest
    if found != standard.codec_digest:
        raise ConfigError(
            f"the model in {folder} must see latents of the codec that it was trained on, {standard.codec} with digest "
            f"{standard.codec_digest}, found digest {found}; use a model of this version, or the weights of its codec"
        )
    model, card = load_model(folder, precision=config.precision)
    chosen = device or ("cuda" if torch.cuda.is_available() else "cpu")
    return Agent(model.to(chosen), Eye(codec, card.standard, card.config), config, watcher)
