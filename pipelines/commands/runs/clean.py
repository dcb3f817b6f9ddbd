"""`wsm clean`: delete what a finished release no longer needs."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.runs.options import Run


def clean(
    run: Run,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be deleted, with its bytes.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
) -> None:
    """Delete the clips of encode that stand in the shards of a finished release, and damaged files set aside."""
    from pipelines.operations.runs.clean import clean as work

    work(Path(run).absolute(), dry_run, yes)


COMMAND = Command(name="clean", summary="Delete what a finished release no longer needs.", call=clean)
