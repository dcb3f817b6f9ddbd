"""The closed loop: a planner drives many environments side by side, each through one episode after the other."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from wsm_data.planners.planner import Plan, Planner
from wsm_data.sim.config import SimConfig
from wsm_data.sim.environment import Environment
from wsm_data.sim.result import Rollout


@dataclass(frozen=True, kw_only=True)
class _Request:
    """An observation that was handed to the planner, and its answer, which is due some steps later."""

    observed_step: int
    due_step: int
    plan: Plan | None


def run_episodes(
    planner: Planner, episodes: Iterable[Environment], config: SimConfig, environments: int
) -> Iterator[Rollout]:
    """Drive through episodes, up to `environments` of them at a time, and yield each when it ends.

    All environments advance in lockstep. One that has no request with the planner makes one; its answer, whatever time
    it takes, is followed `latency_steps` later, and the next request is made then. Nothing depends on the clock, nor,
    for a planner whose environments are independent, on how many run side by side.

    Args:
        planner: it is reset.
        episodes: taken one by one as environments become free, so they may be made on the way; whoever makes them
            decides what becomes of those that are refused.
        config: settings.
        environments: how many run side by side, at least 1.

    Yields:
        Rollouts in the order in which they end.
    """
    planner.reset(config.intrinsics, environments)
    waiting = iter(episodes)
    running: dict[int, Environment] = {}
    requests: dict[int, _Request] = {}
    while True:
        for slot in range(environments):
            if slot not in running and (following := next(waiting, None)) is not None:
                running[slot] = following
                planner.reset_environment(slot)
                requests.pop(slot, None)
        if not running:
            return
        _ask(planner, running, requests, config)
        for slot, environment in list(running.items()):
            environment.advance()
            if environment.ending is not None:
                yield environment.rollout()
                del running[slot]


def _ask(planner: Planner, running: dict[int, Environment], requests: dict[int, _Request], config: SimConfig) -> None:
    """Follow the answers that are due, and make the requests of all environments that have none."""
    _follow_due(running, requests)
    asking = {slot: one.observe(planner.senses) for slot, one in running.items() if slot not in requests}
    if not asking:
        return
    plans = planner.plan(asking)
    for slot, observation in asking.items():
        due = observation.step + config.latency_steps
        requests[slot] = _Request(observed_step=observation.step, due_step=due, plan=plans[slot])
    _follow_due(running, requests)


def _follow_due(running: dict[int, Environment], requests: dict[int, _Request]) -> None:
    for slot, environment in running.items():
        request = requests.get(slot)
        if request is not None and request.due_step <= environment.step:
            if request.plan is not None:
                environment.follow(request.plan, request.observed_step)
            del requests[slot]
