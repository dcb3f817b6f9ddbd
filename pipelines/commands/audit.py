"""`wsm audit`: what leaks between the splits of a release, is there twice, or contradicts itself."""

from enum import StrEnum
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Release
from wsm_data.curation.audit.finding import Severity
from wsm_data.curation.split import SplitBy


class FailOn(StrEnum):
    """From which severity on an audit fails."""

    INFO = Severity.INFO.value
    WARNING = Severity.WARNING.value
    ERROR = Severity.ERROR.value
    NEVER = "never"


def audit(
    release: Release,
    split_by: Annotated[
        SplitBy, typer.Option("--split-by", help="What the split promises to keep on one side.")
    ] = SplitBy.TRAJECTORY,
    fail_on: Annotated[
        FailOn, typer.Option("--fail-on", help="Mildest finding that ends with exit code 4.")
    ] = FailOn.ERROR,
    near_m: Annotated[
        float, typer.Option("--near", help="Paths that stay this close, in metres, count as near-duplicates.")
    ] = 0.5,
    as_json: Annotated[bool, typer.Option("--json", help="All findings as JSON.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar.")] = False,
) -> None:
    """Audit a release."""
    from pipelines.operations import audit as operation

    worst = None if fail_on is FailOn.NEVER else Severity(fail_on.value)
    operation.audit(release, split_by, worst, near_m, as_json, quiet)


COMMAND = Command(
    name="audit", summary="Find split leaks, repeated content and contradicting labels of a release.", call=audit
)
