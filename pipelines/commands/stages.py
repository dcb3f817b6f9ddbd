"""`wsm STAGE`, `wsm run` and `wsm demo`: build configs, run stages, print what came of it."""

import json
import logging
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from pipelines.config import config_json, merge, parse_assignments
from pipelines.engines.choice import engine
from pipelines.folder import read_stage_record
from pipelines.recipe import Recipe, load_recipe, stage_config, stage_sections
from pipelines.registry import load_stage, load_stage_module
from pipelines.report import StageReport, summary_table
from pipelines.runner import RunOptions, fingerprint, run_stage
from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json
from wsm_data.files.typed_toml import build_config, load_toml


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
    """
    if name == "verify" and out is None:
        clips = load_stage_module(name).require_sound(release, options["quiet"])
        typer.echo(f"{release} is whole: {clips} clips, every byte and every trajectory accounted for")
        return
    stage = load_stage(name)
    values = stage_sections(load_toml(config), str(config)).get(name, {}) if config else {}
    given = {"release": release} if release else {}
    built = build_config(stage.config_type, merge(merge(values, given), parse_assignments(assignments or ())), "")
    report = _run(name, built, out or Path(name), options.pop("engine"), _options(options))
    typer.echo(summary_table([report]))


def run_recipe(recipe: str, out: Path, config: Path | None, assignments: Sequence[str] | None, **options: Any) -> None:
    """Run the stages of a recipe into `out`, each in a folder of its own, and say where the results are."""
    loaded = load_recipe(recipe, config, parse_assignments(assignments or ()))
    if (
        options["limit"] or options["only"]
    ):  # the selection narrows the first stage; the release says that it is partial
        loaded = replace(loaded, settings=merge({"pack": {"partial": True}}, loaded.settings))
    engine_name = options.pop("engine")
    run_options = _options(options)
    out = _fork(loaded, out) if run_options.fork else out
    run_options = replace(run_options, fork=False)
    reports: list[StageReport] = []
    for position, name in enumerate(loaded.stages):
        if run_options.dry_run and not _inputs_exist(loaded, name, out):
            typer.echo(f"{name}: will be planned when the stages before it have run")
            continue
        built = stage_config(loaded, name, out)
        chosen = run_options if position == 0 else replace(run_options, limit=0, only=())
        reports.append(_run(name, built, out / name, engine_name, chosen))
    typer.echo(summary_table(reports))
    for label, path in (("release", out / "pack" / "release"), ("report", out / "report" / "report.html")):
        if path.exists():
            typer.echo(f"{label}: {path}")


def _run(name: str, config: Any, out: Path, engine_name: str, options: RunOptions) -> StageReport:
    if options.dry_run:
        typer.echo(f"{name}: settings\n{json.dumps(config_json(config), indent=2)}")
    report = run_stage(load_stage(name), config, out, options, engine(engine_name))
    if options.dry_run:
        for unit in report.ran:
            typer.echo(f"{name}: would do {unit}")
    return report


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


def _inputs_exist(recipe: Recipe, name: str, out: Path) -> bool:
    try:
        load_stage(name).list_units(stage_config(recipe, name, out))
    except ConfigError:
        return False
    return True
