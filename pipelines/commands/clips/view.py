"""`wsm view`: a release, a run or a source as pages on this machine."""

from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.extras import require_extra

PORT = 8765


def view(
    location: Annotated[
        str,
        typer.Argument(metavar="RELEASE|RUN|SOURCE", help="Release, folder or URL; or folder of a run or a source."),
    ],
    beside: Annotated[str, typer.Option("--beside", help="Another release, which is shown side by side.")] = "",
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Port of this machine's loopback; 0: any that is free.")
    ] = PORT,
    dataset: Annotated[
        str, typer.Option("--dataset", help="Manifest to read a source with; left out: the first that fits.")
    ] = "",
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
) -> None:
    """Serve the pages until Ctrl-C or SIGTERM; they can be reached from this machine alone, and change nothing."""
    require_extra("view", ("starlette", "uvicorn"))
    from pipelines.operations.clips import view as operation

    operation.serve_pages(operation.shown(location, beside, dataset, weights), port)


COMMAND = Command(
    name="view",
    summary="Look through a release, a run or a source in a browser; the pages stay on this machine.",
    call=view,
)
