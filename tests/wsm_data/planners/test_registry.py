import subprocess
import sys

import pytest

from wsm_data.errors import ConfigError
from wsm_data.planners.planner import GoalFrame, Sense
from wsm_data.planners.registry import PLANNER_NAMES, PlannerConfig, make_planner


@pytest.mark.parametrize("name", PLANNER_NAMES)
def test_each_planner_has_its_name_and_makes_its_environments(name, camera):
    planner = make_planner(name, PlannerConfig())
    assert planner.name == name
    planner.reset(camera, 2)
    planner.reset_environment(1)


def test_who_sees_the_map_and_who_is_told_the_pose_is_declared():
    senses = {name: make_planner(name, PlannerConfig()).senses for name in PLANNER_NAMES}
    assert [name for name in PLANNER_NAMES if Sense.MAP in senses[name]] == ["oracle"]
    assert [name for name in PLANNER_NAMES if Sense.POSE not in senses[name]] == ["map-and-plan-estimated"]


def test_a_goal_that_is_given_anew_each_time_spares_the_pose_to_those_that_only_place_their_goal_by_it():
    config = PlannerConfig(goal=GoalFrame.CURRENT)
    posed = [name for name in PLANNER_NAMES if Sense.POSE in make_planner(name, config).senses]
    assert posed == ["oracle", "map-and-plan"]


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(ConfigError, match=r"oracle, straight-line, .* found 'navdp'"):
        make_planner("navdp", PlannerConfig())


def test_the_built_in_planners_need_no_torch():
    program = "import sys, wsm_data.planners.registry; assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)
