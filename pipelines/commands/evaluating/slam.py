"""`wsm eval slam`: camera poses and points against the truth of a release."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Out, Quiet, Release


def eval_slam(
    release: Release,
    out: Out,
    model: Annotated[Path | None, typer.Option("--model", help="Folder of a model.")] = None,
    estimates: Annotated[
        Path | None,
        typer.Option("--estimates", help="Folder of another system's estimates: KEY/ with a TUM and a PLY file each."),
    ] = None,
    split: Annotated[str, typer.Option("--split", help="Split of the clips; '': all.")] = "test",
    limit: Annotated[int, typer.Option("--limit", min=0, help="At most this many clips; 0: all.")] = 0,
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the intervals.")] = 0,
    quiet: Quiet = False,
) -> None:
    """Evaluate one system."""
    from pipelines.operations.evaluating import slam as operation

    request = operation.SlamRequest(
        model=model, estimates=estimates, split=split, limit=limit, weights=weights, seed=seed
    )
    operation.eval_slam(release, request, out, quiet)


COMMAND = Command(name="slam", summary="Camera poses and points against the truth, with intervals.", call=eval_slam)
