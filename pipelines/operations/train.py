"""`wsm train`: pretrain the model on releases."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import typer

from pipelines.running.settings import config_json, merge, parse_assignments
from pipelines.training.config import TrainRunConfig
from pipelines.training.data import model_config, needs_depth
from pipelines.training.pretrain import run_training
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config, load_toml
from wsm_data.loaders.config import LoaderConfig
from wsm_data.loaders.loader import ClipLoader


def train(
    release: str | None,
    out: Path,
    config: Path | None,
    assignments: Sequence[str],
    dry_run: bool,
    quiet: bool,
) -> None:
    """Train in `out`, and print the errors on held-out clips.

    Args:
        release: folder or URL of the one release that is trained on; None where the settings name the sources.
        out: folder of the run.
        config: TOML file of differences to the defaults.
        assignments: `key=value` words.
        dry_run: show settings and sizes, write nothing.
        quiet: no progress bars.

    Raises:
        ConfigError: a setting is wrong or missing, or sources are named twice.
    """
    built = train_config(release, config, assignments)
    if dry_run:
        typer.echo(json.dumps(config_json(built), indent=1))
        typer.echo(describe(built))
        return
    table = run_training(built, out, quiet=quiet)
    if table:
        typer.echo(table)
    if table is not None:
        typer.echo(f"model: {out / 'model'}\ncurves: {out / 'curves.png'}")


def train_config(release: str | None, config: Path | None, assignments: Sequence[str]) -> TrainRunConfig:
    """Settings of a run.

    Raises:
        ConfigError: a setting is wrong or missing, or sources are named twice.
    """
    values = merge(load_toml(config) if config else {}, parse_assignments(assignments))
    if release and "sources" in values:
        raise ConfigError("the sources are named twice: leave RELEASE out, or `sources` out of the settings")
    if release:
        values["sources"] = [{"release": release}]
    if "sources" not in values:
        raise ConfigError("`wsm train` must know what to train on: add RELEASE, or `[[sources]]` to the settings")
    return build_config(TrainRunConfig, values)


def describe(config: TrainRunConfig) -> str:
    """What a run would do, in a few lines; no clip is read."""
    read = replace(config.read, device="cpu")
    settings = LoaderConfig(sources=config.sources, order=config.order, read=read, depth=needs_depth(config))
    with ClipLoader(settings, rank=0, world_size=1) as loader:
        manifest = loader.sources.tables[0].release.manifest
        shape = model_config(config, manifest)
        steps = config.training.max_steps or config.training.epochs * loader.steps
        return "\n".join(
            [
                f"clips: {loader.sources.clips}, {loader.steps} steps an epoch of {config.order.global_batch} rows",
                f"steps: {steps}",
                f"model: {config.model.size}, {shape.layers} layers, widths {shape.generation.width}, "
                f"{shape.depth.width}, {shape.pose.width}, {sum(shape.tokens.values())} tokens a latent frame",
            ]
        )
