"""`wsm check`: is a source sound?"""

from pipelines.commands.command import Command
from pipelines.commands.options import Quiet, Workers
from pipelines.commands.soundness.options import AsJson, Baseline, Dataset, Github, Sarif, Source


def check(
    source: Source,
    dataset: Dataset = "",
    workers: Workers = 0,
    as_json: AsJson = False,
    sarif: Sarif = None,
    baseline: Baseline = None,
    github: Github = False,
    quiet: Quiet = False,
) -> None:
    """Run every check of a run on a source. Exit code 3 where something is wrong."""
    from pipelines.operations.soundness.check_source import check_source
    from pipelines.operations.soundness.findings import Telling

    telling = Telling(as_json=as_json, sarif=sarif, baseline=baseline, github=github, quiet=quiet)
    check_source(source, dataset, workers, telling)


COMMAND = Command(
    name="check",
    summary="Run every check of a run on a source, and write nothing. Exit code 3 where something is wrong.",
    call=check,
)
