"""`wsm verify`: a stage like the others where it is given a folder, and a proof without a record where it is not."""

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


def verify(
    release: Release,
    payload: Annotated[
        bool,
        typer.Option(
            "--payload/--no-payload", help="Read every shard; without: sizes, and the checksums that a store states."
        ),
    ] = True,
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
    """Verify a release."""
    from pipelines.operations.run_stage import run_one
    from pipelines.operations.verify import verify_stored, verify_without_record

    request = stage_request(
        out, config, assignments, workers, engine, limit, only, dry_run, max_refused, fork, retry_refused, quiet
    )
    if not payload:
        verify_stored(release, request)
    elif request.out is None:
        verify_without_record(release, request)
    else:
        run_one("verify", request, release)


COMMAND = Command(name="verify", summary="Prove that a release is whole, or name the damage.", call=verify)
