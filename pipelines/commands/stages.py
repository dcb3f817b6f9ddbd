"""`wsm STAGE`, `wsm run` and `wsm demo`: build configs, run stages, print what came of it."""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import Any

import typer

from pipelines.commands.dry_run import show_run, show_stage
from pipelines.recipe import Recipe, load_recipe, stage_config, stage_sections
from pipelines.registry import load_stage, load_stage_module
from pipelines.running.engines.choice import EngineName, engine
from pipelines.running.folder import read_stage_record
from pipelines.running.runner import RunOptions, fingerprint, run_stage
from pipelines.running.settings import input_fields, merge, parse_assignments
from pipelines.running.stage import Stage
from pipelines.running.stage_report import summary_table
from wsm_data.codecs.registry import CodecConfig, describe_codec
from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json
from wsm_data.files.typed_toml import build_config, load_toml

_RESULTS: Mapping[str, tuple[str, str]] = {
    "pack": ("release", "release"),
    "score": ("scores", "scores.parquet"),
    "report": ("report", "report.html"),
}
"""What a stage makes for people to look at: what it is called, and where in the stage's folder it lies."""


def run_one(
    name: str,
    out: Path | None,
    config: Path | None,
    assignments: Sequence[str] | None,
    release: str | None = None,
    **options: Any,
) -> None:
    """Run one stage with settings from its section of a TOML file and from `--set`.

    Args:
        name: the stage.
        out: its folder; without one, a report goes to report/, and a release is verified without a record of it.
        config: TOML file with a section of the stage's name.
        assignments: `key=value` words.
        release: the release that `verify` and `report` look at.
        options: what to run now.

    Raises:
        ConfigError: a setting, an input or an option is wrong, missing or of no use here.
    """
    if name == "verify" and out is None:
        _refuse_unused({**options, "config": config, "set": assignments})
        clips = load_stage_module(name).require_sound(release, options["quiet"])
        typer.echo(f"{release} is whole: {clips} clips, every byte and every trajectory accounted for")
        return
    built = stage_settings(name, config, assignments, release)
    folder = run_built(load_stage(name), built, out or Path(name), options)
    if not options["dry_run"]:
        _print_result(name, folder)


def stage_settings(
    name: str, config: Path | None, assignments: Sequence[str] | None, release: str | None = None
) -> Any:
    """Settings of a stage, from its section of a TOML file and from `--set`.

    Raises:
        ConfigError: a setting is wrong, or an input is missing.
    """
    stage = load_stage(name)
    values = stage_sections(load_toml(config), str(config)).get(name, {}) if config else {}
    given = {"release": release} if release else {}
    values = merge(merge(values, given), parse_assignments(assignments or ()))
    _require_inputs(name, stage.config_type, values)
    return build_config(stage.config_type, values, "")


def run_built(stage: Stage[Any], config: Any, out: Path, options: Mapping[str, Any]) -> Path:
    """Run a stage, or show what it would do, and print its table; returns its folder (another one after a fork).

    Raises:
        ConfigError: an input or an option is wrong.
    """
    chosen = _options({name: value for name, value in options.items() if name != "engine"})
    if chosen.dry_run:
        show_stage(stage, config, out, chosen)
        return out
    report = run_stage(stage, config, out, chosen, engine(options["engine"]))
    typer.echo(summary_table([report]))
    return report.out


def run_recipe(recipe: str, out: Path, config: Path | None, assignments: Sequence[str] | None, **options: Any) -> None:
    """Run the stages of a recipe into `out`, each in a folder of its own, and say where the results are.

    The settings of all stages are built before the first of them runs.

    Raises:
        ConfigError: the recipe, a setting or an option is wrong.
    """
    loaded = load_recipe(recipe, config, parse_assignments(assignments or ()))
    if options["limit"] or options["only"]:  # it narrows the first stage; the release says that it is partial
        loaded = replace(loaded, settings=merge({"pack": {"partial": True}}, loaded.settings))
    run_engine = engine(options.pop("engine"))
    chosen = _options(options)
    out = _fork(loaded, out) if chosen.fork else out
    first = replace(chosen, fork=False)
    others = replace(first, limit=0, only=())
    configs = _checked_configs(loaded, out)
    if chosen.dry_run:
        show_run(configs, out, first, others)
        return
    for position, (name, built) in enumerate(configs.items()):
        report = run_stage(load_stage(name), built, out / name, others if position else first, run_engine)
        typer.echo(summary_table([report]))  # now, for a later stage may stop the run
    for name in configs:
        _print_result(name, out / name)


def _checked_configs(recipe: Recipe, out: Path) -> dict[str, Any]:
    """Settings of every stage, in the order of the flow."""
    configs = {name: stage_config(recipe, name, out) for name in recipe.stages}
    for config in configs.values():
        codec = getattr(config, "codec", None)
        if isinstance(codec, CodecConfig):
            describe_codec(codec)  # it fails where the codec cannot be built, and loads no network
    return configs


def _require_inputs(name: str, config_type: Any, values: Mapping[str, Any]) -> None:
    """Name every input that is missing at once; what else may be wrong is found when the config is built."""
    known = {one.name: one for one in fields(config_type)}
    required = [one for one in input_fields(config_type) if known[one].default is MISSING]
    missing = [one for one in required if one not in values]
    if missing and set(values) <= set(known):
        words = " ".join(f"--set {one}=FOLDER" for one in missing)
        raise ConfigError(f"`wsm {name}` must know where its inputs are: add {words}")


def _refuse_unused(options: Mapping[str, Any]) -> None:
    """A release that is verified without a record has neither settings nor units: only `quiet` counts."""
    unset = {**vars(RunOptions()), "workers": 0, "engine": EngineName.LOCAL}
    unused = [name for name, value in options.items() if name != "quiet" and value and value != unset.get(name)]
    if unused:
        words = ", ".join(f"--{name.replace('_', '-')}" for name in unused)
        raise ConfigError(
            f"without --out the whole release is read and nothing is recorded, so {words} would do nothing: leave that "
            "out, or add --out FOLDER"
        )


def _print_result(name: str, out: Path) -> None:
    label, place = _RESULTS.get(name, ("", ""))
    if label and (out / place).exists():
        typer.echo(f"{label}: {out / place}")


def _options(values: dict[str, Any]) -> RunOptions:
    logging.basicConfig(format="%(levelname)s %(message)s", level=logging.WARNING)
    workers = values.pop("workers") or os.cpu_count() or 1
    only = tuple(values.pop("only") or ())
    return RunOptions(workers=workers, only=only, **values)


def _fork(recipe: Recipe, out: Path) -> Path:
    """The run folder, or one beside it where a stage's folder was written with other settings."""
    wanted = {name: fingerprint(load_stage(name), stage_config(recipe, name, out)) for name in recipe.stages}
    records = {name: read_stage_record(out / name) for name in recipe.stages}
    if all(record is None or record.fingerprint == wanted[name] for name, record in records.items()):
        return out
    return out.with_name(f"{out.name}-{digest_json(wanted)[:8]}")
