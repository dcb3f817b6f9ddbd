"""`wsm posttrain`: a pretrained model learns from its own dreams of a selection."""

import json
from collections.abc import Sequence
from pathlib import Path

import typer

from pipelines.posttraining.config import PosttrainRunConfig
from pipelines.posttraining.measuring import MEASURES
from pipelines.posttraining.run import require_fit, run_posttraining
from pipelines.running.settings import config_json, merge, parse_assignments
from wsm_data.access.release import open_release
from wsm_data.files.typed_toml import build_config, load_toml
from wsm_data.loaders.config import LoaderConfig
from wsm_data.loaders.queries import QueryLoader


def posttrain(
    model: Path,
    release: str,
    selection: str,
    out: Path,
    config: Path | None,
    assignments: Sequence[str],
    *,
    merged: bool,
    dry_run: bool,
    quiet: bool,
) -> None:
    """Post-train in `out`, and print what was measured before and after.

    Args:
        model: folder of the pretrained model.
        release: folder or URL.
        selection: name or path of a selection of it.
        out: folder of the run.
        config: TOML file of differences to the defaults.
        assignments: `key=value` words.
        merged: write the merged model too.
        dry_run: show settings and sizes; write nothing.
        quiet: no progress bars.

    Raises:
        ConfigError: a setting is wrong, or model, release and selection do not fit one another.
    """
    built = posttrain_config(model, release, selection, config, assignments)
    if dry_run:
        _describe(built)
        return
    found = run_posttraining(built, out, merge=merged, quiet=quiet)
    if found is None:
        return
    if found:
        typer.echo(f"{found['queries']} queries of {found['scenes']} scenes, {found['dreams']} dreams each")
        for measure in MEASURES:
            parts = [f"{name} {_interval(found[name][measure])}" for name in ("before", "after", "difference")]  # type: ignore[index]
            typer.echo(f"{measure:13} {'  '.join(parts)}")
    typer.echo(f"adapter: {out / 'adapter'}" + (f"\nmodel: {out / 'model'}" if merged else ""))


def posttrain_config(
    model: Path, release: str, selection: str, config: Path | None, assignments: Sequence[str]
) -> PosttrainRunConfig:
    """Settings of a run.

    Raises:
        ConfigError: a setting is wrong or missing.
    """
    given = {"model": str(model), "source": {"release": release, "selection": selection}}
    values = merge(load_toml(config) if config else {}, parse_assignments(assignments))
    return build_config(PosttrainRunConfig, merge(values, given))


def _describe(config: PosttrainRunConfig) -> None:
    card = require_fit(config, open_release(config.source.release))
    settings = LoaderConfig(sources=(config.source,), order=config.order, read=config.read)
    typer.echo(json.dumps(config_json(config), indent=1))
    with QueryLoader(settings, config.queries, rank=0, world_size=1) as loader:
        steps = config.posttraining.max_steps or config.posttraining.epochs * loader.steps
        adapters = 4 * card.config.layers * config.posttraining.adapters.rank
        adapters *= card.config.generation.width + card.config.attention_width
        typer.echo(
            f"queries: {loader.sources.clips}, {loader.steps} steps an epoch of {config.order.global_batch}\n"
            f"steps: {steps}, each {config.order.global_batch} groups of {config.posttraining.group} dreams\n"
            f"parameters that learn: {adapters:,}"
        )


def _interval(estimate: dict[str, float]) -> str:
    return f"{estimate['value']:.3f} [{estimate['low']:.3f}, {estimate['high']:.3f}]"
