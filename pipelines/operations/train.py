"""`wsm train`: pretrain the model on releases."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import typer

from pipelines import training
from pipelines.running.settings import config_json, merge, parse_assignments
from pipelines.training.config import TrainRunConfig
from pipelines.training.data import model_config, needs_depth
from pipelines.training.plan import plan_text, require_fit, training_plan
from pipelines.training.pretrain import run_training
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config, load_toml
from wsm_data.loaders.config import LoaderConfig
from wsm_data.loaders.loader import ClipLoader

_RECIPES = Path(training.__file__).parent / "recipes"
"""Settings for a size on some hardware, that fit by calculation."""


def train(
    release: str | None,
    out: Path,
    config: Path | None,
    assignments: Sequence[str],
    init: Path | None,
    dry_run: bool,
    anyway: bool,
    quiet: bool,
) -> None:
    """Train in `out`, and print the errors on held-out clips.

    Args:
        release: folder or URL of the one release that is trained on; None where the settings name the sources.
        out: folder of the run.
        config: TOML file of differences to the defaults.
        assignments: `key=value` words.
        init: folder of weights to start from.
        dry_run: show settings, sizes and what the run would take; write nothing.
        anyway: of a dry run, do not refuse what cannot fit into memory.
        quiet: no progress bars.

    Raises:
        ConfigError: a setting is wrong or missing, sources are named twice, or memory is too small by calculation.
    """
    built = train_config(release, config, assignments, init)
    if dry_run:
        typer.echo(json.dumps(config_json(built), indent=1))
        describe(built, anyway)
        return
    table = run_training(built, out, quiet=quiet)
    if table:
        typer.echo(table)
    if table is not None:
        typer.echo(f"model: {out / 'model'}\ncurves: {out / 'curves.png'}")


def train_config(
    release: str | None, config: Path | None, assignments: Sequence[str], init: Path | None
) -> TrainRunConfig:
    """Settings of a run.

    Raises:
        ConfigError: a setting is wrong or missing, or sources are named twice.
    """
    values = merge(load_toml(recipe_path(config)) if config else {}, parse_assignments(assignments))
    if init is not None:
        values = merge(values, {"model": {"init": str(init)}})
    if release and "sources" in values:
        raise ConfigError("the sources are named twice: leave RELEASE out, or `sources` out of the settings")
    if release:
        values["sources"] = [{"release": release}]
    if "sources" not in values:
        raise ConfigError("`wsm train` must know what to train on: add RELEASE, or `[[sources]]` to the settings")
    return build_config(TrainRunConfig, values)


def recipe_path(config: Path) -> Path:
    """A file of settings, or a packaged one by its name.

    Raises:
        ConfigError: there is neither.
    """
    packaged = {path.stem: path for path in _RECIPES.glob("*.toml")}
    if not config.is_file() and str(config) not in packaged:
        raise ConfigError(f"{config} must be a TOML file or one of {', '.join(sorted(packaged))}")
    return config if config.is_file() else packaged[str(config)]


def describe(config: TrainRunConfig, anyway: bool) -> None:
    """Print what a run would do and take; no clip is read.

    Raises:
        ConfigError: it cannot fit into the memory that is planned with, unless `anyway`.
    """
    read = replace(config.read, device="cpu")
    settings = LoaderConfig(sources=config.sources, order=config.order, read=read, depth=needs_depth(config))
    with ClipLoader(settings, rank=0, world_size=1) as loader:
        manifest = loader.sources.tables[0].release.manifest
        shape = model_config(config, manifest)
        plan = training_plan(config, shape, loader)
        typer.echo(f"clips: {loader.sources.clips}, {loader.steps} steps an epoch of {config.order.global_batch} rows")
        typer.echo(f"steps: {plan.steps}")
        typer.echo(
            f"model: {config.model.size}, {shape.layers} layers, widths {shape.generation.width}, "
            f"{shape.depth.width}, {shape.pose.width}, {sum(shape.tokens.values())} tokens a latent frame"
        )
        typer.echo(plan_text(plan, config))
        if not anyway:
            require_fit(plan, config)
