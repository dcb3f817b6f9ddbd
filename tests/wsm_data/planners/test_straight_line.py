import numpy as np

from wsm_data.planners.planner import GoalFrame, Observation
from wsm_data.planners.straight_line import StraightLine


def test_it_drives_straight_at_the_goal_wherever_it_has_come():
    pose = np.array([1.0, 0.0, 0.3])
    plan = StraightLine().plan(
        Observation(step=7, goal_xy_m=np.array([4.0, 1.0]), goal_frame=GoalFrame.START, pose=pose)
    )
    wanted = np.arctan2(1.0, 3.0) - 0.3
    np.testing.assert_allclose(np.arctan2(plan.path_m[:, 1], plan.path_m[:, 0]), wanted, atol=1e-9)


def test_it_turns_to_a_goal_behind():
    plan = StraightLine().plan(Observation(step=0, goal_xy_m=np.array([-4.0, -1.0]), goal_frame=GoalFrame.CURRENT))
    assert (plan.path_m == (0.0, -1.0)).all()
