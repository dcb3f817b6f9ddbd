"""Planners whose environments know nothing of one another: one object for each."""

from collections.abc import Callable, Mapping
from typing import Protocol

from wsm_data.planners.planner import Observation, Plan, Sense
from wsm_data.schema.camera import Intrinsics


class EpisodePlanner(Protocol):
    """Plans one episode from its first observation to its last."""

    def plan(self, observation: Observation) -> Plan:
        """Answer to one observation."""
        ...


class IndependentPlanner:
    """A `Planner` made of one `EpisodePlanner` for each environment.

    Args:
        name: as it stands in tables.
        senses: what its observations hold.
        make: makes the planner of an episode for a camera.
    """

    def __init__(self, name: str, senses: frozenset[Sense], make: Callable[[Intrinsics], EpisodePlanner]):
        self.name = name
        self.senses = senses
        self._make = make
        self._intrinsics: Intrinsics | None = None
        self._episodes: list[EpisodePlanner] = []

    def reset(self, intrinsics: Intrinsics, environments: int) -> None:
        """Forget everything."""
        self._intrinsics = intrinsics
        self._episodes = [self._make(intrinsics) for _ in range(environments)]

    def reset_environment(self, environment: int) -> None:
        """Forget one environment."""
        if self._intrinsics is None:
            raise ValueError("reset must come before reset_environment")
        self._episodes[environment] = self._make(self._intrinsics)

    def plan(self, observations: Mapping[int, Observation]) -> Mapping[int, Plan | None]:
        """Answer for each environment by its own planner."""
        return {number: self._episodes[number].plan(observation) for number, observation in observations.items()}
