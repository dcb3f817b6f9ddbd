"""`wsm`: the commands of `pipelines.commands`, and what becomes of their errors."""

import errno
import logging
import sys
from collections.abc import Callable
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from pipelines.commands import audit, audit_run, bench, inspect, run, serve, settings, source, stages, stores, train
from pipelines.commands.clips import export, film, view
from pipelines.commands.command import Command, CommandGroup
from pipelines.commands.evaluating import group as evaluate
from pipelines.commands.models import dream, posttrain
from pipelines.commands.models import group as models
from pipelines.commands.runs import clean, plan, retry
from pipelines.commands.soundness import audit_latents, check, preflight
from pipelines.running.interrupts import (
    INTERRUPTED_EXIT_CODE,
    TERMINATED_EXIT_CODE,
    Terminated,
    arriving_interrupts,
)
from wsm_data.errors import WsmError
from wsm_data.files.atomic import is_full_disk
from wsm_data.files.locations import require_local

COMMANDS: tuple[Command | CommandGroup, ...] = (
    *stages.COMMANDS,
    run.RUN_COMMAND,
    run.DEMO_COMMAND,
    run.STATUS_COMMAND,
    plan.COMMAND,
    clean.COMMAND,
    retry.COMMAND,
    settings.COMMAND,
    stores.PUBLISH_COMMAND,
    stores.FETCH_COMMAND,
    stores.MERGE_COMMAND,
    inspect.COMMAND,
    view.COMMAND,
    film.COMMAND,
    export.GROUP,
    audit_run.COMMAND,
    audit.COMMAND,
    train.COMMAND,
    posttrain.COMMAND,
    evaluate.GROUP,
    dream.COMMAND,
    models.GROUP,
    serve.COMMAND,
    source.GROUP,
    preflight.COMMAND,
    check.COMMAND,
    audit_latents.COMMAND,
    bench.GROUP,
)
"""In the order of `wsm --help`."""


_OF_A_FILE = (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ENAMETOOLONG)
"""What the system says where a path that somebody named cannot be read or written: no fault of the program."""


class _Commands(TyperGroup):
    """Turns foreseen errors into one message and their exit code; anything else keeps its traceback."""

    def invoke(self, ctx: Any) -> object:
        logging.basicConfig(format="%(levelname)s %(message)s", level=logging.WARNING)
        try:
            with arriving_interrupts():
                return super().invoke(ctx)
        except WsmError as error:
            _fail(str(error), error.exit_code)
        except Terminated:
            _fail("terminated; run the same command again to go on where it stopped", TERMINATED_EXIT_CODE)
        except KeyboardInterrupt:
            _fail("interrupted; run the same command again to go on where it stopped", INTERRUPTED_EXIT_CODE)
        except OSError as error:
            if is_full_disk(error):
                _fail(f"the disk is full ({error}); free space and run the same command again", 1)
            if error.filename is None or error.errno not in _OF_A_FILE:
                raise
            _fail(f"{error.filename} cannot be used ({error.strerror}); name another place, or restore this one", 1)


def _fail(message: str, code: int) -> NoReturn:
    typer.echo(f"error: {message}", err=True)
    sys.exit(code)


def _with_local_paths(call: Callable[..., None]) -> Callable[..., None]:
    """The same command, which refuses a URL wherever it takes a path, before any work."""

    @wraps(call)
    def checked(**values: object) -> None:
        for name, value in values.items():
            if isinstance(value, Path):
                require_local(f"--{name.replace('_', '-')}", value)
        call(**values)

    return checked


def _add(to: typer.Typer, command: Command | CommandGroup) -> None:
    if isinstance(command, Command):
        to.command(command.name, help=command.summary, epilog=command.epilog)(_with_local_paths(command.call))
        return
    group = typer.Typer(help=command.summary, no_args_is_help=True)
    for one in command.commands:
        _add(group, one)
    to.add_typer(group, name=command.name)


app = typer.Typer(
    cls=_Commands,
    help="From navigation trajectories to a verified release of shards for the World SLAM Model.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"wsm {version('wsm')}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options that stand before a command."""


for _command in COMMANDS:
    _add(app, _command)


if __name__ == "__main__":
    app()
