"""`wsm audit-run`: the proof that a run saw each clip as often as its order says."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command


def audit_run(
    ledger: Annotated[Path, typer.Argument(metavar="LEDGER", help="Folder in which a loader recorded its steps.")],
    release: Annotated[
        list[str],
        typer.Option("--release", help="Release of the run: every step is compared with its order. Repeatable."),
    ],
    selection: Annotated[
        list[str] | None,
        typer.Option("--selection", help="Selection file of the run that is not in its release. Repeatable."),
    ] = None,
    clip: Annotated[str | None, typer.Option("--clip", help="Show the steps that brought this clip.")] = None,
    epoch: Annotated[int | None, typer.Option("--epoch", min=0, help="Epoch of --step.")] = None,
    step: Annotated[int | None, typer.Option("--step", min=0, help="Show what this step brought.")] = None,
) -> None:
    """Audit a ledger, or answer one question about it."""
    from pipelines.operations import audit_run as operation

    operation.audit_run(ledger, release, selection or [], clip, epoch, step)


COMMAND = Command(
    name="audit-run", summary="Prove from its ledger that a training run saw each clip once an epoch.", call=audit_run
)
