"""The planner that every other must beat: straight to the goal, whatever stands there."""

from wsm_data.planners.planner import Observation, Plan, goal_in_base
from wsm_data.planners.steering import Steering


class StraightLine:
    """Turns towards the goal and drives; it sees nothing."""

    def __init__(self) -> None:
        self._steering = Steering()

    def plan(self, observation: Observation) -> Plan:
        """Answer to one observation."""
        goal = goal_in_base(observation)
        return Plan(path_m=self._steering.path(goal[None], observation.step, float("inf")))
