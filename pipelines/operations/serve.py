"""`wsm serve`: a planner behind the public HTTP protocol."""

from pathlib import Path

import typer

from pipelines.evaluating.nav.config import AGENT
from wsm_data.errors import ConfigError
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.server import PlannerServer, ServerConfig
from wsm_data.planners.http.service import GOAL_FRAMES, PlannerService, require_servable
from wsm_data.planners.planner import Planner
from wsm_data.planners.registry import PlannerConfig, make_planner


def served_planner(name: str, model: Path | None, codec_weights: str, client: GoalClient) -> Planner:
    """The planner of a name for such clients; the agent is the only one that has a model.

    Raises:
        ConfigError: there is no such planner or model, one is missing or of no use, or the model is of another codec.
        IntegrityError: the model's files are damaged.
    """
    if (name == AGENT) != (model is not None):
        raise ConfigError(f"--model FOLDER belongs to --planner {AGENT}, found planner {name} and model {model}")
    if model is None:
        return make_planner(name, PlannerConfig(goal=GOAL_FRAMES[client]))
    from wsm_model.agent.config import AgentConfig
    from wsm_model.agent.load import load_agent

    return load_agent(model, AgentConfig(), codec_weights=codec_weights)


def serve(planner: Planner, client: GoalClient, host: str, port: int) -> None:
    """Serve a planner until Ctrl-C or SIGTERM; what is being answered then is answered.

    Args:
        planner: whoever answers.
        client: whose requests these are.
        host: address to listen at.
        port: 0 for any that is free; the first line that is printed says which.

    Raises:
        ConfigError: it needs what the protocol does not bring, or the address cannot be had.
    """
    require_servable(planner)
    try:
        server = PlannerServer(PlannerService(planner, client), ServerConfig(host=host, port=port))
    except OSError as error:
        raise ConfigError(f"{host}:{port} must be a free address of this machine, but: {error}") from error
    typer.echo(f"{planner.name} for {client} clients at {server.url}, health at {server.url}/health")
    try:
        server.serve_forever()
    except KeyboardInterrupt:  # SIGTERM, too
        typer.echo("stopping: what is being answered is answered")
    finally:
        server.server_close()
