"""The planner of an evaluation."""

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from pipelines.evaluating.nav.config import NavConfig, is_url
from wsm_data.planners.http.client import ClientConfig, HttpPlanner
from wsm_data.planners.planner import Planner
from wsm_data.planners.registry import PlannerConfig, make_planner

if TYPE_CHECKING:
    from wsm_model.agent.agent import Agent, Watcher
    from wsm_model.agent.config import AgentConfig


def open_planner(config: NavConfig, watcher: "Watcher | None" = None) -> Planner:
    """Build the planner; a model is read once a process.

    Args:
        config: settings.
        watcher: is shown the dreams of the agent.

    Raises:
        ConfigError: there is no such model, or it is of another codec; a URL is none.
        IntegrityError: the files of a model are damaged.
    """
    if config.model is not None and config.agent is not None:
        agent = _agent(config.model, config.codec_weights, config.agent)
        agent.watcher = watcher
        return agent
    if is_url(config.planner):
        return HttpPlanner(config.planner, ClientConfig())
    return make_planner(config.planner, PlannerConfig(robot=config.sim.robot, goal=config.sim.goal))


@lru_cache(maxsize=1)
def _agent(model: Path, codec_weights: str, config: "AgentConfig") -> "Agent":
    """The agent; on the processor it computes on one thread, so that nothing depends on the number of cores."""
    import torch

    from wsm_model.agent.load import load_agent

    if not torch.cuda.is_available():
        torch.set_num_threads(1)
    return load_agent(model, config, codec_weights=codec_weights)
