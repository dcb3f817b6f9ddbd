"""A trained model on disk: `model.safetensors`, and `model.json` with all that is needed to use it as it was trained.

Latents of another codec, or standardised with other statistics, are other numbers altogether: a model file names those
it was trained on, and refuses others.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import nn

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import sha256_file
from wsm_data.files.typed_toml import build_config
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.config import ModelConfig
from wsm_model.model import WorldSlamModel
from wsm_model.precision import Precision, matrices
from wsm_model.ranks import rank_and_world_size, wait_for_all, whole

WEIGHTS_FILE = "model.safetensors"
CARD_FILE = "model.json"


@dataclass(frozen=True, kw_only=True)
class ModelCard:
    """What a model file says of itself.

    Attributes:
        config: shape of the model.
        standard: of its latents.
        releases: digests of the releases it was trained on.
        steps: optimiser steps.
        weights_sha256: digest of the weights' file.
        depth_range: what its depth latents stand for; None in files that do not say.
    """

    config: ModelConfig
    standard: LatentStandard
    releases: tuple[str, ...]
    steps: int
    weights_sha256: str = ""
    depth_range: DepthRange | None = None


def save_model(folder: Path, model: WorldSlamModel, card: ModelCard) -> None:
    """Write a model; with several ranks each tensor is put together on all and written by the first.

    The card is written last: a folder without it holds no model.
    """
    rank, _ = rank_and_world_size()
    tensors: dict[str, torch.Tensor] = {}
    for name, parameter in model.named_parameters():
        full = whole(parameter.detach())
        if rank == 0:
            tensors[name] = full.cpu().contiguous()
    if rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / CARD_FILE).unlink(missing_ok=True)
        save_file(tensors, folder / WEIGHTS_FILE)
        record = asdict(card) | {"weights_sha256": sha256_file(folder / WEIGHTS_FILE)}
        _write_card(folder, record)
    wait_for_all()


def save_card(folder: Path, card: ModelCard) -> None:
    """Write what the weights in a folder, such as those of checkpoints, are."""
    _write_card(folder, asdict(card))


def _write_card(folder: Path, record: Mapping[str, object]) -> None:
    write_text(folder / CARD_FILE, json.dumps(record, indent=2, sort_keys=True) + "\n")


def load_card(folder: Path) -> ModelCard:
    """Read `model.json`.

    Raises:
        ConfigError: there is none.
        IntegrityError: it is not the card of a model.
    """
    path = folder / CARD_FILE
    if not path.is_file():
        raise ConfigError(f"there is no model in {folder}: it must hold {CARD_FILE} and {WEIGHTS_FILE}")
    try:
        return build_config(ModelCard, json.loads(path.read_text()))
    except (ValueError, ConfigError) as error:
        raise IntegrityError(f"{path} must be the card of a model, but: {error}; restore the file") from error


def load_model(
    folder: Path, standard: LatentStandard | None = None, precision: Precision = Precision.FLOAT32
) -> tuple[WorldSlamModel, ModelCard]:
    """Read a model, in evaluation mode.

    Args:
        folder: of the model.
        standard: of the latents it is to be used on; None where that is checked by the caller.
        precision: how its matrices are kept in memory; in bfloat16 it is for use and not for training.

    Raises:
        ConfigError: there is no model, or it was trained on latents of another codec or other statistics.
        IntegrityError: its files are damaged.
    """
    card = load_card(folder)
    if standard is not None:
        require_standard(card, standard)
    require_weights(folder, card)
    path = folder / WEIGHTS_FILE
    with torch.device("meta"):
        model = WorldSlamModel(card.config)
    _fill(model, path, precision)
    return model.eval(), card


def require_weights(folder: Path, card: ModelCard) -> None:
    """Check that the weights of a model are those of its card.

    Raises:
        IntegrityError: they are not.
    """
    path = folder / WEIGHTS_FILE
    found = sha256_file(path) if path.is_file() else "no file"
    if found != card.weights_sha256:
        raise IntegrityError(f"{path} must have sha256 {card.weights_sha256}, found {found}; restore the file")


def require_standard(card: ModelCard, standard: LatentStandard) -> None:
    """Check that latents are those a model was trained on.

    Raises:
        ConfigError: another codec or other statistics; says which.
    """
    other = [one.name for one in fields(standard) if getattr(standard, one.name) != getattr(card.standard, one.name)]
    if other:
        raise ConfigError(
            f"the model was trained on latents of {card.standard.codec} (digest {card.standard.codec_digest}), and "
            f"these differ in {', '.join(other)} ({standard.codec}, digest {standard.codec_digest}); use data of the "
            "same codec and the statistics that the model was trained with"
        )


def _fill(model: nn.Module, path: Path, precision: Precision) -> None:
    """Give a model on the meta device its parameters; no more than one tensor is there twice."""
    parameters: Mapping[str, nn.Parameter] = dict(model.named_parameters())
    rounded = matrices(model) if precision is Precision.BFLOAT16 else set()
    filled: dict[str, torch.Tensor] = {}
    try:
        with safe_open(path, framework="pt") as file:
            names = set(file.keys())
            if names != set(parameters):
                raise ValueError(
                    f"its tensors must be those of the model, differing: {sorted(names ^ set(parameters))[:3]}"
                )
            for name, parameter in parameters.items():
                tensor = file.get_tensor(name)
                if tensor.shape != parameter.shape:
                    raise ValueError(
                        f"{name} must have the shape {tuple(parameter.shape)}, found {tuple(tensor.shape)}"
                    )
                filled[name] = tensor.to(torch.bfloat16 if name in rounded else torch.float32)
    except (SafetensorError, ValueError) as error:
        raise IntegrityError(f"{path} must hold the weights of its card, but: {error}; restore the file") from error
    model.load_state_dict(filled, assign=True)
