"""`wsm serve`: a planner behind the public HTTP protocol."""

from pathlib import Path
from typing import Annotated

import typer

from pipelines.commands.command import Command
from wsm_data.planners.http.goal_client import GoalClient


def serve(
    planner: Annotated[
        str, typer.Option("--planner", help="agent, or built in: map-and-plan-estimated, reactive, ...")
    ],
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port to listen at; 0: any that is free.")],
    model: Annotated[Path | None, typer.Option("--model", help="Folder of the model of --planner agent.")] = None,
    codec_weights: Annotated[str, typer.Option("--codec-weights", help="Folder of the codec's weights, if any.")] = "",
    client: Annotated[
        GoalClient, typer.Option("--client", help="Whose requests these are: their goals, and one key of the answer.")
    ] = GoalClient.START_GOAL,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen at; this one is reached from this machine alone.")
    ] = "127.0.0.1",
) -> None:
    """Serve until Ctrl-C or SIGTERM."""
    from pipelines.operations import serve as operation

    operation.serve(operation.served_planner(planner, model, codec_weights, client), client, host, port)


COMMAND = Command(name="serve", summary="Serve a planner over the public HTTP protocol.", call=serve)
