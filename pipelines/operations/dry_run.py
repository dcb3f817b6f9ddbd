"""`--dry-run`: settings and units, and nothing written."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import typer

from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.settings import config_json, input_fields
from pipelines.running.stage import ConfigT, Stage
from pipelines.running.stage_report import StageReport, summary_table
from pipelines.running.upstream import UpstreamMissing
from wsm_data.shards.names import MANIFEST_NAME

_SHOWN_UNITS = 20


def show_stage(stage: Stage[ConfigT], config: ConfigT, out: Path, options: RunOptions) -> None:
    """Print the settings of one stage and what it would do."""
    _show_settings(stage, config)
    report = run_stage(stage, config, out, options)
    _show_units(report)
    typer.echo(summary_table([report]))


def show_run(configs: Mapping[str, object], out: Path, first: RunOptions, others: RunOptions) -> None:
    """Print the settings of every stage of a run, then what each would do that can be planned already.

    Args:
        configs: the stages' settings, in the order of the flow.
        out: the run's folder.
        first: options of the first stage.
        others: options of those after it.

    Raises:
        ConfigError: a stage could not begin, although those before it have nothing to do.
    """
    for name, config in configs.items():
        _show_settings(load_stage(name), config)
    reports: list[StageReport] = []
    waiting = False  # whether a stage before has something to do, so that what follows from it is not known yet
    for name, config in configs.items():
        options = others if reports else first
        unknown = waiting and _awaits_input(config, configs, out)
        report = None if unknown else _plan(name, config, out, options, waiting)
        if report is None:
            typer.echo(f"{name}: will be planned when the stages before it have run")
            continue
        _show_units(report)
        waiting = waiting or bool(report.ran)
        reports.append(report)
    typer.echo(summary_table(reports))


def _plan(name: str, config: object, out: Path, options: RunOptions, waiting: bool) -> StageReport | None:
    """What a stage would do; None where only a stage that has yet to run can tell."""
    try:
        return run_stage(load_stage(name), config, out / name, options)
    except UpstreamMissing:
        if not waiting:
            raise
        return None


def _awaits_input(config: object, stages: Iterable[str], out: Path) -> bool:
    """Whether an input that the run makes itself is not there yet; a release is there when its manifest is."""
    for name in input_fields(config):
        path = Path(str(getattr(config, name)))
        made_here = any(path.is_relative_to(out / stage) for stage in stages)
        if made_here and not (path / MANIFEST_NAME if name == "release" else path).exists():
            return True
    return False


def _show_settings(stage: Stage[ConfigT], config: ConfigT) -> None:
    typer.echo(f"{stage.name}: settings\n{json.dumps(config_json(config), indent=2)}")
    if stage.conventions is not None:
        said = config_json(stage.conventions(config))
        typer.echo(f"{stage.name}: conventions of the source\n{json.dumps(said, indent=2)}")


def _show_units(report: StageReport) -> None:
    for unit in report.ran[:_SHOWN_UNITS]:
        typer.echo(f"{report.stage}: would do {unit}")
    if len(report.ran) > _SHOWN_UNITS:
        typer.echo(f"{report.stage}: and {len(report.ran) - _SHOWN_UNITS} more, {len(report.ran)} in all")
