"""`wsm select`: choose clips, and on request show them on a page or copy them into a release of their own."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import (
    Assignments,
    Config,
    DryRun,
    Engine,
    Fork,
    Limit,
    MaxRefused,
    Only,
    OutOfRelease,
    Quiet,
    Release,
    RetryRefused,
    Workers,
)
from pipelines.commands.stage_options import REQUEST, RUN, stage_request


def select(
    release: Release,
    report: Annotated[bool, typer.Option("--report", help="Write NAME.html: what was chosen, and why.")] = False,
    materialise: Annotated[
        Path | None,
        typer.Option("--materialise", help="Folder for the chosen clips as a release of their own, verified."),
    ] = None,
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, for pictures.")] = "",
    out: OutOfRelease = REQUEST.out,
    config: Config = REQUEST.config,
    assignments: Assignments = None,
    workers: Workers = RUN.workers,
    engine: Engine = REQUEST.engine,
    limit: Limit = RUN.limit,
    only: Only = None,
    dry_run: DryRun = RUN.dry_run,
    max_refused: MaxRefused = RUN.max_refused,
    fork: Fork = RUN.fork,
    retry_refused: RetryRefused = RUN.retry_refused,
    quiet: Quiet = RUN.quiet,
) -> None:
    """Write a selection, and what is asked for beside it."""
    from pipelines.operations.select import run_select

    request = stage_request(
        out, config, assignments, workers, engine, limit, only, dry_run, max_refused, fork, retry_refused, quiet
    )
    run_select(release, request, report=report, materialise=materialise, weights=weights)


COMMAND = Command(name="select", summary="Choose the hard share of a release, with reasons.", call=select)
