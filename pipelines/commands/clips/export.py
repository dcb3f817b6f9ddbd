"""`wsm export`: clips of a release in the layout of other programs."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command, CommandGroup
from pipelines.commands.options import Release

Split = Annotated[str, typer.Option("--split", help="Only clips of this split; default: all.")]
Limit = Annotated[int, typer.Option("--limit", min=0, help="At most this many clips; 0: all.")]
Weights = Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")]


def tum(
    release: Release,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write; each clip is a sequence below it.")],
    split: Split = "",
    limit: Limit = 0,
    weights: Weights = "",
) -> None:
    """Write clips as sequences of TUM's RGB-D benchmark."""
    from pipelines.operations.clips.export_tum import export_tum

    export_tum(release, out, split, limit, weights)


def lerobot(
    release: Release,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write, new or empty.")],
    split: Split = "",
    limit: Limit = 0,
    weights: Weights = "",
) -> None:
    """Write clips as a LeRobot data set of version 3; needs the extra `lerobot`."""
    from pipelines.operations.clips.export_lerobot import export_lerobot

    export_lerobot(release, out, split, limit, weights)


GROUP = CommandGroup(
    name="export",
    summary="Write clips of a release in the layout of other programs.",
    commands=(
        Command(name="tum", summary="Write clips as sequences of TUM's RGB-D benchmark.", call=tum),
        Command(name="lerobot", summary="Write clips as a LeRobot data set of version 3.", call=lerobot),
    ),
)
