"""`wsm run` and `wsm demo`: the stages of a recipe, in one run folder; `wsm status`: where it stands."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.stage_options import filling
from pipelines.recipe import recipe_summaries
from pipelines.running.options import StageRequest
from wsm_data.errors import ConfigError
from wsm_data.files.locations import is_url


def run_recipe(
    recipe: Annotated[str, typer.Argument(metavar="RECIPE", help="Name of a recipe, or path of a TOML file.")],
    request: StageRequest,
    out: Annotated[str, typer.Option("--out", "-o", help="Folder or URL to write; what is done there is kept.")],
    work: Annotated[
        Path | None, typer.Option("--work", help="Folder in which the stages work, where --out is a URL.")
    ] = None,
) -> None:
    """Run the stages of any recipe."""
    if is_url(out):
        from pipelines.operations.runs.at_url import run_at_url

        run_at_url(recipe, request, out, work)
    elif work is not None:
        raise ConfigError(f"--work is for an --out that is a URL, found {out}; leave it out")
    else:
        _run(recipe, request)


def run_demo(request: StageRequest) -> None:
    """Run the recipe that generates its own data."""
    _run("demo", request)


def status(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run, or of one stage.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one line of JSON in place of the table.")] = False,
    watch: Annotated[bool, typer.Option("--watch", help="Print it again every two seconds, until Ctrl-C.")] = False,
    prometheus: Annotated[
        Path | None, typer.Option("--prometheus", help="File for a node's exporter, replaced each time.")
    ] = None,
) -> None:
    """Show where a run stands, while it runs or afterwards."""
    from pipelines.operations.status import show_status

    show_status(run, as_json, watch, prometheus)


def _run(recipe: str, request: StageRequest) -> None:
    from pipelines.operations.run_recipe import run_recipe as work

    work(recipe, request)


def _recipe_list() -> str:
    """The recipes of the project, one a line; the first line keeps click from wrapping them."""
    return "\n".join(["\b", "Recipes:", *(f"  {name}: {summary}" for name, summary in recipe_summaries().items())])


RUN_COMMAND = Command(
    name="run",
    summary="Run the stages of a recipe into one run folder.",
    call=filling(run_recipe),
    epilog=_recipe_list(),
)
DEMO_COMMAND = Command(name="demo", summary="The main job, end to end, on generated data.", call=filling(run_demo))
STATUS_COMMAND = Command(
    name="status", summary="Show where the stages of a run stand, while it runs or afterwards.", call=status
)
