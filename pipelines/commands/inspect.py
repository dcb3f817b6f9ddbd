"""`wsm inspect`: what is in a release, and one clip as a picture or a recording."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Release


def inspect(
    release: Release,
    key: Annotated[
        str | None, typer.Argument(metavar="[KEY]", help="One clip: its key or the id of its trajectory.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Contact sheet to write; default: KEY.png here.")
    ] = None,
    rerun: Annotated[
        Path | None,
        typer.Option(
            "--rerun", help="Recording of the clip (.rrd) to write, in place of a contact sheet without --out."
        ),
    ] = None,
    limit: Annotated[int, typer.Option("--limit", min=0, help="Clips to list; 0: all.")] = 20,
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, and without a picture.")] = False,
) -> None:
    """Show a release, or a clip of it."""
    from pipelines.operations.inspect import inspect_release, print_json
    from wsm_data.errors import ConfigError

    if as_json and (out or rerun):
        raise ConfigError("--json writes no file: leave out --out and --rerun, or --json")
    if as_json:
        print_json(release, key, limit)
        return
    inspect_release(release, key, out, rerun, limit, weights)


COMMAND = Command(name="inspect", summary="List a release, or show one clip and draw it.", call=inspect)
