import numpy as np
import pytest

from wsm_data.planners.independent import IndependentPlanner
from wsm_data.planners.planner import GoalFrame, Observation, Plan, Sense


class Counter:
    """Answers with how often it was asked."""

    def __init__(self):
        self.asked = 0

    def plan(self, observation):
        self.asked += 1
        return Plan(path_m=np.full((2, 2), float(self.asked)))


def observation():
    return Observation(step=0, goal_xy_m=np.zeros(2), goal_frame=GoalFrame.CURRENT)


def asked(planner, *environments):
    answers = planner.plan({number: observation() for number in environments})
    return {number: answer.path_m[0, 0] for number, answer in answers.items()}


def test_each_environment_has_a_state_of_its_own(camera):
    planner = IndependentPlanner("counter", frozenset({Sense.POSE}), lambda _: Counter())
    planner.reset(camera, 3)
    assert asked(planner, 0, 2) == {0: 1, 2: 1}
    assert asked(planner, 0, 1) == {0: 2, 1: 1}
    planner.reset_environment(0)
    assert asked(planner, 0, 1, 2) == {0: 1, 1: 2, 2: 2}


def test_an_environment_cannot_be_reset_before_all_are(camera):
    with pytest.raises(ValueError, match="reset must come before"):
        IndependentPlanner("counter", frozenset(), lambda _: Counter()).reset_environment(0)
