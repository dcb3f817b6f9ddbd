"""`wsm retry`: try again what was refused for a reason."""

from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Engine, LogFile, MaxRefused, Quiet, Slurm, Verbose, Workers
from pipelines.commands.runs.options import Run
from pipelines.commands.stage_options import REQUEST, stage_request


def retry(
    run: Run,
    reason: Annotated[list[str], typer.Option("--reason", help="Reason code, as frame.undecodable. Repeatable.")],
    workers: Workers = REQUEST.options.workers,
    engine: Engine = REQUEST.engine,
    slurm: Slurm = None,
    max_refused: MaxRefused = REQUEST.options.max_refused,
    quiet: Quiet = REQUEST.options.quiet,
    verbose: Verbose = REQUEST.options.verbose,
    log_file: LogFile = REQUEST.log_file,
) -> None:
    """Do units again of which something was refused for a reason, and what follows from them."""
    from pipelines.operations.runs.retry import retry as work
    from pipelines.running.logs import logged

    values = {"workers": workers, "engine": engine, "slurm": slurm, "max_refused": max_refused, "quiet": quiet}
    request = stage_request({**values, "verbose": verbose, "log_file": log_file})
    with logged(request):
        work(run.absolute(), reason, request)


COMMAND = Command(name="retry", summary="Try again what a run refused for a reason.", call=retry)
