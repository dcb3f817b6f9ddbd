"""What every command that runs stages takes: the signatures, and the value that the options become."""

from collections.abc import Callable
from pathlib import Path

from pipelines.commands.options import (
    Assignments,
    Config,
    DryRun,
    Engine,
    Fork,
    Limit,
    MaxRefused,
    Only,
    Out,
    OutOfRelease,
    Quiet,
    Release,
    RetryRefused,
    Workers,
)
from pipelines.running.engines.choice import EngineName
from pipelines.running.options import RunOptions, StageRequest

REQUEST = StageRequest()
RUN = REQUEST.options
"""What stages are asked where the command line says nothing: the defaults of the options."""


def filling(run: Callable[[StageRequest], None]) -> Callable[..., None]:
    """A command that fills a folder."""

    def command(
        out: Out,
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
        run(
            stage_request(
                out, config, assignments, workers, engine, limit, only, dry_run, max_refused, fork, retry_refused, quiet
            )
        )

    return command


def reading(run: Callable[[str, StageRequest], None]) -> Callable[..., None]:
    """A command that looks at a release."""

    def command(
        release: Release,
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
        request = stage_request(
            out, config, assignments, workers, engine, limit, only, dry_run, max_refused, fork, retry_refused, quiet
        )
        run(release, request)

    return command


def stage_request(
    out: Path | None,
    config: Path | None,
    assignments: list[str] | None,
    workers: int,
    engine: EngineName,
    limit: int,
    only: list[str] | None,
    dry_run: bool,
    max_refused: float,
    fork: bool,
    retry_refused: bool,
    quiet: bool,
) -> StageRequest:
    """The options of a command that runs stages as one value."""
    options = RunOptions(
        workers=workers,
        limit=limit,
        only=tuple(only or ()),
        dry_run=dry_run,
        max_refused=max_refused,
        fork=fork,
        retry_refused=retry_refused,
        quiet=quiet,
    )
    return StageRequest(out=out, config=config, assignments=tuple(assignments or ()), engine=engine, options=options)
