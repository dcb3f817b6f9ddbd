"""`wsm STAGE`: build the settings of a stage, run it, print what came of it."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path

import typer

from pipelines.operations.dry_run import show_stage
from pipelines.operations.engine import engine_of
from pipelines.recipe import stage_sections
from pipelines.registry import load_stage
from pipelines.running.logs import log_table
from pipelines.running.options import StageRequest
from pipelines.running.runner import run_stage
from pipelines.running.settings import input_fields, merge, parse_assignments
from pipelines.running.stage import ConfigT, Stage
from pipelines.running.stage_report import summary_table
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config, load_toml

_RESULTS: Mapping[str, tuple[str, str]] = {
    "pack": ("release", "release"),
    "score": ("scores", "scores.parquet"),
    "report": ("report", "report.html"),
}
"""What a stage makes for people to look at: what it is called, and where in the stage's folder it lies."""


def run_one(name: str, request: StageRequest, release: str = "") -> None:
    """Run one stage with settings from its section of a TOML file and from `--set`.

    Args:
        name: the stage.
        request: what is asked; without a folder, the one that is named like the stage is filled.
        release: the release, for a stage that looks at one.

    Raises:
        ConfigError: a setting, an input or an option is wrong or missing.
    """
    stage = load_stage(name)
    settings = stage_settings(stage, request, release)
    folder = run_built(stage, settings, request.out or Path(name), request)
    if not request.options.dry_run:
        print_result(name, folder)


def stage_settings(stage: Stage[ConfigT], request: StageRequest, release: str = "") -> ConfigT:
    """Settings of a stage, from its section of a TOML file and from `--set`.

    Raises:
        ConfigError: a setting is wrong, or an input is missing.
    """
    sections = stage_sections(load_toml(request.config), str(request.config)) if request.config else {}
    values = merge(sections.get(stage.name, {}), {"release": release} if release else {})
    values = merge(values, parse_assignments(request.assignments))
    _require_inputs(stage, values)
    return build_config(stage.config_type, values, "")


def run_built(stage: Stage[ConfigT], config: ConfigT, out: Path, request: StageRequest) -> Path:
    """Run a stage, or show what it would do, and print its table; returns its folder (another one after a fork).

    Raises:
        ConfigError: an input or an option is wrong.
    """
    if request.options.dry_run:
        show_stage(stage, config, out, request.options)
        return out
    with engine_of(request) as run_engine:
        report = run_stage(stage, config, out, request.options, run_engine)
    table = summary_table([report])
    typer.echo(table)
    log_table(table)
    return report.out


def print_result(name: str, out: Path) -> None:
    """Say where the result of a stage is, where it has one for people to look at."""
    label, place = _RESULTS.get(name, ("", ""))
    if label and (out / place).exists():
        typer.echo(f"{label}: {out / place}")


def _require_inputs(stage: Stage[ConfigT], values: Mapping[str, object]) -> None:
    """Name every input that is missing at once; what else may be wrong is found when the config is built."""
    known = {one.name: one for one in fields(stage.config_type)}  # type: ignore[arg-type]
    required = [one for one in input_fields(stage.config_type) if known[one].default is MISSING]
    missing = [one for one in required if one not in values]
    if missing and set(values) <= set(known):
        words = " ".join(f"--set {one}=FOLDER" for one in missing)
        raise ConfigError(f"`wsm {stage.name}` must know where its inputs are: add {words}")
