"""`wsm audit-latents`: are the latents of a release those of its source?"""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Quiet, Release
from pipelines.commands.soundness.options import AsJson, Baseline, Dataset, Github, Sarif


def audit_latents(
    release: Release,
    source: Annotated[Path, typer.Option("--source", help="Root of the source that it was made of.")],
    share: Annotated[float, typer.Option("--share", help="Share of the clips to encode again; at least one.")] = 0.001,
    dataset: Dataset = "",
    weights: Annotated[str, typer.Option("--weights", help="Folder of the codec's weights, where it has any.")] = "",
    as_json: AsJson = False,
    sarif: Sarif = None,
    baseline: Baseline = None,
    github: Github = False,
    quiet: Quiet = False,
) -> None:
    """Encode some clips again from their source and compare. Exit code 3 where one differs."""
    from pipelines.operations.soundness.audit_latents import audit_release_latents
    from pipelines.operations.soundness.findings import Telling

    telling = Telling(as_json=as_json, sarif=sarif, baseline=baseline, github=github, quiet=quiet)
    audit_release_latents(release, source, dataset, share, weights, telling)


COMMAND = Command(
    name="audit-latents",
    summary="Encode some clips of a release again, and name what changed where they differ.",
    call=audit_latents,
)
