"""`wsm preflight`: did a source come over whole?"""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Quiet, Workers
from pipelines.commands.soundness.options import AsJson, Baseline, Dataset, Github, Sarif, Source


def preflight(
    source: Source,
    dataset: Dataset = "",
    sample: Annotated[
        float,
        typer.Option("--sample", help="Share of the containers to read whole; of other archives only both ends are."),
    ] = 1.0,
    refetch: Annotated[
        Path | None, typer.Option("--refetch", help="File for what to fetch again, one container a line.")
    ] = None,
    workers: Workers = 0,
    as_json: AsJson = False,
    sarif: Sarif = None,
    baseline: Baseline = None,
    github: Github = False,
    quiet: Quiet = False,
) -> None:
    """Look whether a source came over whole. Exit code 3 where it did not."""
    from pipelines.operations.soundness import preflight as operation
    from pipelines.operations.soundness.findings import Telling

    telling = Telling(as_json=as_json, sarif=sarif, baseline=baseline, github=github, quiet=quiet)
    operation.preflight(source, dataset, sample, workers, telling, refetch)


COMMAND = Command(
    name="preflight",
    summary="Find what of a source did not come over whole: pointers, cut archives, missing files.",
    call=preflight,
)
