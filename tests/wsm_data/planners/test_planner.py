import numpy as np
import pytest

from wsm_data.planners.planner import GoalFrame, Observation, Plan, goal_in_base


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"path_m": np.zeros((1, 2))}, "T >= 2"),
        ({"path_m": np.zeros((5, 4))}, "2 or 3"),
        ({"path_m": np.full((5, 2), np.nan)}, "finite"),
        ({"path_m": np.zeros((5, 2)), "candidates_m": np.zeros((3, 5, 2)), "values": np.zeros(2)}, "values must be"),
        ({"path_m": np.zeros((5, 2)), "goal_estimate_m": np.zeros(2)}, "goal_estimate_m must be"),
        ({"path_m": np.zeros((5, 2)), "pose_estimate": np.array([0.0, np.inf, 0.0])}, "pose_estimate must be finite"),
    ],
)
def test_an_answer_of_another_shape_is_refused_by_name(fields, why):
    with pytest.raises(ValueError, match=why):
        Plan(**fields)


def test_an_answer_may_hold_all_that_the_public_protocol_allows():
    plan = Plan(
        path_m=np.zeros((24, 3)),
        candidates_m=np.zeros((16, 24, 3)),
        values=np.zeros(16),
        goal_estimate_m=np.zeros(3),
        pose_estimate=np.zeros(3),
    )
    assert plan.path_m.shape == (24, 3)


def test_a_goal_of_the_start_frame_moves_with_the_pose_and_a_current_one_does_not():
    goal, pose = np.array([2.0, 1.0]), np.array([2.0, 0.0, np.pi / 2])
    start = Observation(step=0, goal_xy_m=goal, goal_frame=GoalFrame.START, pose=pose)
    current = Observation(step=0, goal_xy_m=goal, goal_frame=GoalFrame.CURRENT, pose=pose)
    np.testing.assert_allclose(goal_in_base(start), (1.0, 0.0), atol=1e-15)
    assert (goal_in_base(current) == goal).all()


def test_a_goal_of_the_start_frame_without_a_pose_is_refused():
    with pytest.raises(ValueError, match="needs the pose"):
        goal_in_base(Observation(step=0, goal_xy_m=np.ones(2), goal_frame=GoalFrame.START))
