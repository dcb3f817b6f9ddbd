"""`wsm posttrain`: a pretrained model learns from its own dreams of a selection."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.extras import require_extra
from pipelines.commands.models.options import Model
from pipelines.commands.options import Quiet, Release


def posttrain(
    model: Model,
    release: Release,
    selection: Annotated[
        str, typer.Option("--selection", help="Name of a selection of the release, or path of its file; '' for all.")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the run; it goes on from its last checkpoint.")],
    config: Annotated[Path | None, typer.Option("--config", "-c", help="TOML of differences to the defaults.")] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", "-s", help="One setting: section.key=value. Repeatable.")
    ] = None,
    merge: Annotated[bool, typer.Option("--merge", help="Write OUT/model too: the adapter in its matrices.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show settings and sizes; write nothing.")] = False,
    quiet: Quiet = False,
) -> None:
    """Post-train in a folder."""
    require_extra("posttrain", ("peft", "safetensors", "tensorboard"))
    from pipelines.operations.models import posttrain as operation

    operation.posttrain(
        model, release, selection, out, config, assignments or [], merged=merge, dry_run=dry_run, quiet=quiet
    )


COMMAND = Command(
    name="posttrain", summary="Post-train a model on its own dreams of a selection, scored on maps.", call=posttrain
)
