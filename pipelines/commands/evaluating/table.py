"""`wsm eval table`: the paper's tables, with evaluations of one's own beside them."""

from enum import StrEnum
from typing import Annotated

import typer

from pipelines.commands.command import Command
from pipelines.commands.options import Out


class TableName(StrEnum):
    """A table of the paper."""

    NAVIGATION = "navigation"
    SLAM = "slam"
    IDM = "idm"
    BACKEND = "backend"
    STAGES = "stages"


def table(
    name: Annotated[TableName, typer.Argument(help="Which table.")],
    out: Out,
    evaluations: Annotated[
        list[str] | None,
        typer.Argument(metavar="[LABEL=]DIR...", help="Folders of wsm eval nav, or of wsm eval slam for slam."),
    ] = None,
) -> None:
    """Print the paper's figures and those of the evaluations; write them as text, CSV and picture."""
    from pipelines.operations.evaluating.table import eval_table

    eval_table(name.value, evaluations or [], out)


COMMAND = Command(name="table", summary="A table of the paper, with one's own evaluations beside it.", call=table)
