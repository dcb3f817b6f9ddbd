"""`wsm select`: choose clips, and on request show them on a page or copy them into a release of their own."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.stage_options import reading
from pipelines.running.options import StageRequest


def select(
    release: str,
    request: StageRequest,
    report: Annotated[bool, typer.Option("--report", help="Write NAME.html: what was chosen, and why.")] = False,
    materialise: Annotated[
        Path | None,
        typer.Option("--materialise", help="Folder for the chosen clips as a release of their own, verified."),
    ] = None,
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, for pictures.")] = "",
) -> None:
    """Write a selection, and what is asked for beside it."""
    from pipelines.operations.select import run_select

    run_select(release, request, report=report, materialise=materialise, weights=weights)


COMMAND = Command(name="select", summary="Choose the hard share of a release, with reasons.", call=reading(select))
