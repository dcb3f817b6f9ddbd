"""`wsm plan`: what a run over a source will cost."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Assignments, Config, Gpus, Workers
from pipelines.commands.stage_options import REQUEST, stage_request
from wsm_data.errors import ConfigError


def plan(
    source: Annotated[str, typer.Argument(metavar="SOURCE", help="Root of the source tree.")],
    recipe: Annotated[str, typer.Option("--recipe", help="Recipe that would be run over it.")] = "interndata",
    share: Annotated[float, typer.Option("--share", help="Share of the source that is run to measure it.")] = 0.05,
    work: Annotated[
        Path | None,
        typer.Option("--work", help="Folder in which the sample is run, and deleted; else a temporary one."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder of the run, in which the plan is kept for its report.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one line of JSON in place of the table.")] = False,
    workers: Workers = REQUEST.options.workers,
    gpus: Gpus = REQUEST.options.gpus,
    config: Config = REQUEST.config,
    assignments: Assignments = None,
) -> None:
    """Run a sample of a source on this machine, and say what all of it will cost in hours and bytes."""
    if not 0 < share <= 1:
        raise ConfigError(f"--share must lie in (0, 1], found {share:g}")
    from pipelines.operations.planning.plan import show_plan

    values = {"workers": workers, "gpus": gpus, "config": config, "assignments": assignments, "out": out}
    show_plan(source, recipe, stage_request(values), share, work, as_json)


COMMAND = Command(name="plan", summary="Say what a run over a source will cost, from a sample of it.", call=plan)
