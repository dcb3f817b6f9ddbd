"""`wsm film`: one clip of a release as a film."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Release


def film(
    release: Release,
    key: Annotated[str, typer.Argument(metavar="KEY", help="The clip: its key or the id of its trajectory.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="MP4 to write.")],
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
) -> None:
    """Write a film of a clip: colour, depth, and its way on the map."""
    from pipelines.operations.clips.film import film_clip

    film_clip(release, key, out, weights)


COMMAND = Command(name="film", summary="Write one clip as a film: colour, depth, and its way on the map.", call=film)
