"""`wsm serve`: a planner behind the public HTTP protocol."""

import typer

from wsm_data.errors import ConfigError
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.server import PlannerServer, ServerConfig
from wsm_data.planners.http.service import PlannerService, require_servable
from wsm_data.planners.registry import PlannerConfig, make_planner


def serve(planner: str, client: GoalClient, host: str, port: int) -> None:
    """Serve a planner until Ctrl-C or SIGTERM; what is being answered then is answered.

    Args:
        planner: name of a built-in planner.
        client: whose requests these are.
        host: address to listen at.
        port: 0 for any that is free; the first line that is printed says which.

    Raises:
        ConfigError: there is no such planner, it cannot be served to such clients, or the address cannot be had.
    """
    made = make_planner(planner, PlannerConfig())
    require_servable(made, client)
    try:
        server = PlannerServer(PlannerService(made, client), ServerConfig(host=host, port=port))
    except OSError as error:
        raise ConfigError(f"{host}:{port} must be a free address of this machine, but: {error}") from error
    typer.echo(f"{planner} for {client} clients at {server.url}, health at {server.url}/health")
    try:
        server.serve_forever()
    except KeyboardInterrupt:  # SIGTERM, too
        typer.echo("stopping: what is being answered is answered")
    finally:
        server.server_close()
