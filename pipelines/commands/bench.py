"""`wsm bench`: measures a part of the pipeline on this machine."""

from typing import Annotated

import typer

from pipelines.commands.command import Command, CommandGroup
from pipelines.commands.options import Release


def bench_loader(
    release: Release,
    assignments: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", help="One setting, as read.threads=4, order.global_batch=16, source.split=test."),
    ] = None,
    batches: Annotated[int, typer.Option("--batches", min=1, help="Batches to take at most.")] = 1000,
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, help="Time to measure at most, s.")] = 5.0,
    step_ms: Annotated[
        float, typer.Option("--step-ms", min=0, help="Time a training step takes, ms; 0: take batches as they come.")
    ] = 0.0,
    ranks: Annotated[int, typer.Option("--ranks", min=1, help="Ranks of the run; rank 0 is measured here, alone.")] = 1,
    sweep: Annotated[bool, typer.Option("--sweep", help="Compare 1, 2 and 4 threads too.")] = False,
) -> None:
    """Run the loader doctor."""
    from pipelines.operations import bench

    bench.bench_loader(release, assignments or [], batches, seconds, step_ms / 1000, ranks, sweep)


GROUP = CommandGroup(
    name="bench",
    summary="Measure a part of the pipeline on this machine.",
    commands=(
        Command(
            name="loader",
            summary="The loader doctor: run the real loader, say what holds it up and what to change.",
            call=bench_loader,
        ),
    ),
)
