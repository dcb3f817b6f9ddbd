"""`wsm settings`: every setting with its type, default and meaning."""

from typing import Annotated

import typer

from pipelines.commands.command import Command


def settings(
    stage: Annotated[
        str | None, typer.Argument(metavar="[STAGE]", help="A stage, train or posttrain; without it, all of them.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="As JSON, a list by stage.")] = False,
    as_markdown: Annotated[bool, typer.Option("--markdown", help="As the page docs/settings.md.")] = False,
) -> None:
    """Print settings."""
    from pipelines.operations.settings import show_settings

    show_settings(stage, as_json, as_markdown)


COMMAND = Command(
    name="settings", summary="Every setting of a stage or of training: type, default, meaning.", call=settings
)
