"""When an episode of the start-goal benchmark ends, and when it counts as a success. Versions are not comparable."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from wsm_data.errors import ConfigError
from wsm_data.schema.arrays import Float64Array

STUCK_STEPS, STUCK_M = 30, 0.1
TIME_OUT_STEPS = 800
"""120 s of control steps."""


class Ending(StrEnum):
    """Why an episode ended."""

    ARRIVED = "arrived"
    STUCK = "stuck"
    TIME_OUT = "time_out"


@dataclass(frozen=True, kw_only=True)
class EpisodeRules:
    """The numbers in which the protocols differ.

    Attributes:
        name: of the protocol.
        arrive_m: an episode ends as arrived nearer to the goal than this, m,
        arrive_speed: if also the sum of |velocity| along the world's axes is below this, m/s.
        success_m: success is a goal nearer than this before the last step, whatever the ending, m; None where it is
            to have arrived.
    """

    name: str
    arrive_m: float
    arrive_speed: float
    success_m: float | None

    def ending(self, positions_m: Float64Array, goal_m: Float64Array, velocity: Float64Array) -> Ending | None:
        """Why the episode ends after its last step, or None where it goes on.

        Args:
            positions_m: of the robot, one before the first and one after every step, world; float64 [T + 1, 2].
            goal_m: the goal in the world, m; [2].
            velocity: of the last step, world, m/s; [2].
        """
        if len(positions_m) > TIME_OUT_STEPS:
            return Ending.TIME_OUT
        near = float(np.linalg.norm(goal_m - positions_m[-1])) < self.arrive_m
        if near and float(np.abs(velocity).sum()) < self.arrive_speed:
            return Ending.ARRIVED
        recent = positions_m[1:][-STUCK_STEPS:]
        moved = np.linalg.norm(recent - recent[-1], axis=1).max()
        return Ending.STUCK if len(recent) == STUCK_STEPS and moved < STUCK_M else None

    def success(self, ending: Ending, positions_m: Float64Array, goal_m: Float64Array) -> bool:
        """Whether an ended episode counts as a success."""
        if self.success_m is None:
            return ending == Ending.ARRIVED
        return float(np.linalg.norm(goal_m - positions_m[-2])) < self.success_m


RULES: Mapping[str, EpisodeRules] = MappingProxyType(
    {
        rules.name: rules
        for rules in (
            EpisodeRules(name="paper", arrive_m=1.0, arrive_speed=0.5, success_m=None),
            EpisodeRules(name="navdp-2025-12", arrive_m=1.0, arrive_speed=0.5, success_m=1.5),
            EpisodeRules(name="navdp-2026-06", arrive_m=0.85, arrive_speed=0.3, success_m=1.0),
        )
    }
)


def rules_named(name: str) -> EpisodeRules:
    """The rules of a protocol.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in RULES:
        raise ConfigError(f"a protocol must be one of {', '.join(RULES)}, found {name!r}")
    return RULES[name]
