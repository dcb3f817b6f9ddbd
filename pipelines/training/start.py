"""How a run begins: its model and first weights, what makes it that run, and what its weights are."""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from tqdm import tqdm

from pipelines.training.config import TrainRunConfig
from pipelines.training.data import model_config
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import digest_json
from wsm_data.loaders.loader import ClipLoader
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.manifest import ReleaseManifest
from wsm_model.config import ModelConfig
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import CARD_FILE, ModelCard, load_card
from wsm_model.ranks import build_model, rank_and_world_size
from wsm_model.training.average import start_average
from wsm_model.training.checkpoint import checkpoints
from wsm_model.training.initial import CHECKPOINTS, InitialWeights, fill_from, find_initial, require_shape
from wsm_model.training.loop import TrainingRun, total_steps
from wsm_model.training.schedule import make_optimiser
from wsm_model.weights.from_wan import load_wan_weights

_NOT_PART_OF_A_RUN = (
    "epochs",
    "max_steps",
    "checkpoint_every",
    "keep_checkpoints",
    "log_every",
    "sample_every",
    "evaluate_every",
    "shard_ranks",
    "micro_rows",
    "compile",
    "profile_steps",
)
"""Settings of training that may change between two parts of a run: none of them changes what a step learns.

A run that is to go on for longer follows the schedule of its new length from where it stands.
"""

_LATER_SETTINGS = {
    "training.ema_decay": 0.0,
    "training.rgb_noise": 0.0,
    "training.rgb_noise_probability": 0.5,
    "model.init": "",
    "shape.own_dream_attention": False,
}
"""Settings that change nothing at these values, and are no part of a run then: one that began without them goes on."""


@dataclass(frozen=True, kw_only=True)
class StartedRun:
    """A run before its first step, or before its next.

    Attributes:
        run: what is trained; its checkpoints have not been looked into.
        model: the same model, by its own type.
        card: what its weights will be at the end.
    """

    run: TrainingRun
    model: WorldSlamModel
    card: ModelCard


def with_standard(config: TrainRunConfig, out: Path) -> TrainRunConfig:
    """The settings with the standard of latents that a run's first weights learned by, if they learned by any.

    Raises:
        ConfigError: there are no such weights.
        IntegrityError: their card is damaged.
    """
    if not config.model.init:
        return config
    has_begun = (out / CHECKPOINTS / CARD_FILE).is_file()
    card = load_card(out / CHECKPOINTS) if has_begun else find_initial(Path(config.model.init)).card
    return replace(config, read=replace(config.read, standard=card.standard))


def start_run(config: TrainRunConfig, out: Path, loader: ClipLoader, device: torch.device) -> StartedRun:
    """Build model and optimiser, and give a new run its first weights.

    Raises:
        ConfigError: the settings do not fit the release or the first weights.
        IntegrityError: the first weights are damaged.
    """
    release = loader.sources.tables[0].release
    torch.manual_seed(config.training.seed)
    shape = model_config(config, release.manifest)
    is_new = not checkpoints(out / CHECKPOINTS)
    initial = _initial(config, shape, release.manifest) if is_new else None
    training = config.training
    model = build_model(
        shape, config.model.attention, device, precision=training.precision, shard_ranks=training.shard_ranks
    )
    standard = config.read.standard or latent_standard(release.manifest)
    if config.model.weights and is_new:
        _fill_with_wan(config, out, model)
    if initial is not None:
        fill_from(model, initial)
    run = TrainingRun(
        model=model,
        optimiser=make_optimiser(model, config.training.optimiser),
        folder=out / CHECKPOINTS,
        identity=identity_of(config, loader, model.config, standard),
        average=start_average(model, config.training.ema_decay),
    )
    card = ModelCard(
        config=model.config,
        standard=standard,
        releases=tuple(sorted({table.release.digest for table in loader.sources.tables})),
        steps=total_steps(config.training, loader),
        depth_range=release.manifest.depth_range,
    )
    return StartedRun(run=run, model=model, card=card)


def identity_of(
    config: TrainRunConfig, loader: ClipLoader, shape: ModelConfig, standard: LatentStandard
) -> dict[str, object]:
    """What checkpoints of a run must agree on, by dotted name; the loader's own state covers data and order."""
    training = {
        name: value for name, value in dataclasses.asdict(config.training).items() if name not in _NOT_PART_OF_A_RUN
    }
    parts = {
        "model": dataclasses.asdict(config.model),
        "shape": dataclasses.asdict(shape),
        "latent_standard": digest_json(dataclasses.asdict(standard)),
        "training": training,
        "dtype_of_latents": config.read.dtype,
        "steps_of_an_epoch": loader.steps,
    }
    found = _dotted(json.loads(json.dumps(parts)))
    return {name: value for name, value in found if value != _LATER_SETTINGS.get(name, ...)}


def _initial(config: TrainRunConfig, shape: ModelConfig, manifest: ReleaseManifest) -> InitialWeights | None:
    """The weights that are started from, if they fit."""
    if not config.model.init:
        return None
    initial = find_initial(Path(config.model.init))
    require_shape(initial, shape)
    if initial.card.depth_range not in (None, manifest.depth_range):
        raise ConfigError(
            f"depth latents must stand for what the weights learned, {initial.card.depth_range}, but the release "
            f"{manifest.name} has {manifest.depth_range}; encode it again in that range"
        )
    return initial


def _fill_with_wan(config: TrainRunConfig, out: Path, model: WorldSlamModel) -> None:
    """Start from pretrained weights, and say what became of each tensor."""
    report = load_wan_weights(model, config.model.weights)
    rank, _ = rank_and_world_size()
    if rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        write_text(out / "weights.json", json.dumps(dataclasses.asdict(report), indent=1) + "\n")
        tqdm.write(report.summary())


def _dotted(parts: Mapping[str, Any], where: str = "") -> Iterator[tuple[str, object]]:
    for name, value in parts.items():
        dotted = f"{where}{name}"
        if isinstance(value, Mapping):
            yield from _dotted(value, f"{dotted}.")
        else:
            yield dotted, value
