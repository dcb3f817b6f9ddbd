"""`wsm source`: what a folder of data holds, before anything is written; and a source that is recorded here."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command, CommandGroup
from pipelines.commands.options import Quiet


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


def miniworld(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Root of the source that is written.")],
    scenes: Annotated[int, typer.Option("--scenes", min=1, help="Scenes: mazes, rooms and boxes in turn.")] = 6,
    episodes: Annotated[int, typer.Option("--episodes", min=1, help="Drives in each scene.")] = 4,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Scenes and drives follow from it.")] = 0,
    quiet: Quiet = False,
) -> None:
    """Record an expert's drives through scenes of MiniWorld, for `wsm run arrays`."""
    from pipelines.operations.record_miniworld import RecordRequest, record_miniworld
    from wsm_data.sim.config import SimConfig

    request = RecordRequest(scenes=scenes, episodes=episodes, seed=seed)
    record_miniworld(out, request, SimConfig(), quiet=quiet)


GROUP = CommandGroup(
    name="source",
    summary="Look at data before it is read into a release, or record some.",
    commands=(
        Command(
            name="describe",
            summary="Say what a source holds, how it would be read, and what would be refused. Writes nothing.",
            call=describe,
        ),
        Command(
            name="miniworld",
            summary="Record an expert's drives through scenes of MiniWorld: a source that `wsm run arrays` reads.",
            call=miniworld,
        ),
    ),
)
