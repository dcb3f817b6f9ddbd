"""Endings and success on planted episodes."""

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.sim.rules import RULES, Ending, rules_named

GOAL = np.array([10.0, 0.0])


def line(*xs):
    return np.column_stack([xs, np.zeros(len(xs))])


@pytest.mark.parametrize(
    ("protocol", "distance_m", "velocity", "arrives"),
    [
        ("paper", 0.99, (0.3, 0.19), True),
        ("paper", 0.99, (0.3, -0.21), False),  # the sum of |velocity| counts, not its length
        ("paper", 1.01, (0.0, 0.0), False),
        ("navdp-2025-12", 0.99, (0.3, 0.19), True),
        ("navdp-2025-12", 1.01, (0.0, 0.0), False),
        ("navdp-2026-06", 0.84, (0.2, -0.09), True),
        ("navdp-2026-06", 0.84, (0.2, 0.11), False),
        ("navdp-2026-06", 0.86, (0.0, 0.0), False),
    ],
)
def test_an_episode_has_arrived_when_it_is_near_and_slow(protocol, distance_m, velocity, arrives):
    positions = line(0.0, 5.0, 10.0 - distance_m)
    assert (RULES[protocol].ending(positions, GOAL, np.array(velocity)) == Ending.ARRIVED) == arrives


def test_a_robot_is_stuck_after_thirty_steps_within_a_tenth_of_a_metre():
    rules, still = rules_named("paper"), np.zeros(2)
    assert rules.ending(line(*[0.0] * 30), GOAL, still) is None  # 29 steps
    assert rules.ending(line(*[0.0] * 31), GOAL, still) == Ending.STUCK
    creeping = np.arange(40) * 0.0035  # 29 steps of 3.5 mm are 0.1015 m
    assert rules.ending(line(*creeping), GOAL, still) is None
    assert rules.ending(line(*(creeping * 0.95)), GOAL, still) == Ending.STUCK


def test_an_episode_is_out_of_time_after_800_steps_even_near_the_goal():
    moving = 9.5 * np.arange(801) / 800
    assert rules_named("paper").ending(line(*moving), GOAL, np.zeros(2)) == Ending.TIME_OUT
    assert rules_named("paper").ending(line(*moving[:800]), GOAL, np.ones(2)) is None


@pytest.mark.parametrize(
    ("protocol", "ending", "before_last_m", "success"),
    [
        ("paper", Ending.ARRIVED, 1.05, True),
        ("paper", Ending.STUCK, 0.2, False),
        ("navdp-2025-12", Ending.STUCK, 1.49, True),
        ("navdp-2025-12", Ending.TIME_OUT, 1.51, False),
        ("navdp-2026-06", Ending.STUCK, 0.99, True),
        ("navdp-2026-06", Ending.ARRIVED, 1.01, False),
    ],
)
def test_success_is_what_the_protocol_calls_so(protocol, ending, before_last_m, success):
    positions = line(0.0, 10.0 - before_last_m, 9.99)
    assert RULES[protocol].success(ending, positions, GOAL) == success


def test_an_unknown_protocol_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match="paper, navdp-2025-12, navdp-2026-06, found 'x-navdp'"):
        rules_named("x-navdp")
