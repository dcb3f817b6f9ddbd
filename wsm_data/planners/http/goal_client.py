"""Who asks over the public protocol."""

from enum import StrEnum


class GoalClient(StrEnum):
    """Whose goals these are, which decides one key of the answer."""

    START_GOAL = "start-goal"
    """The goal is sent once seen and never changes; the answer says where the planner believes it to be."""
    POINT_GOAL = "point-goal"
    """The goal is recomputed from the true pose for every request; a client of these stumbles over that key."""
