"""`wsm source`: what a folder of data holds, before anything is written."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command, CommandGroup


def describe(
    source: Annotated[Path, typer.Argument(metavar="PATH", help="Root of the source.")],
    dataset: Annotated[
        str, typer.Option("--dataset", help="Manifest to read it with, name or TOML file; empty: guess.")
    ] = "",
    limit: Annotated[int, typer.Option("--limit", min=0, help="Containers to read; 0: all.")] = 3,
    as_json: Annotated[bool, typer.Option("--json", help="All that was found as JSON.")] = False,
) -> None:
    """Say what a source holds and what of it would be refused."""
    from pipelines.operations.describe_source import show_source

    show_source(source, dataset, limit, as_json)


GROUP = CommandGroup(
    name="source",
    summary="Look at data before it is read into a release.",
    commands=(
        Command(
            name="describe",
            summary="Say what a source holds, how it would be read, and what would be refused. Writes nothing.",
            call=describe,
        ),
    ),
)
