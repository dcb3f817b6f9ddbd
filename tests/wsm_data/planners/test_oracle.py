import numpy as np
import pytest

from wsm_data.geometry.planar import points_in_base
from wsm_data.planners.oracle import Oracle
from wsm_data.planners.planner import GoalFrame, KnownMap, Observation


def observe(grid, start, goal, pose=(0.0, 0.0, 0.0)):
    start = np.array(start)
    return Observation(
        step=0,
        goal_xy_m=points_in_base(np.array([goal]), start)[0],
        goal_frame=GoalFrame.START,
        pose=np.array(pose),
        known_map=KnownMap(grid=grid, start_pose=start),
    )


def test_it_heads_for_the_door_and_not_for_the_goal_behind_the_wall(two_rooms):
    path = Oracle(0.25).plan(observe(two_rooms, (1.0, 3.5, -0.9), (5.0, 3.5))).path_m
    assert path[-1, 0] > 0.5
    assert abs(np.arctan2(path[5, 1], path[5, 0])) < 0.5  # the door lies 0.9 rad to the right of the goal


def test_it_turns_where_the_way_leads_behind(two_rooms):
    path = Oracle(0.25).plan(observe(two_rooms, (1.0, 1.5, np.pi), (5.0, 1.5))).path_m
    assert (path[:, 0] == 0).all()
    assert (np.abs(path[:, 1]) == 1).all()


def test_it_stands_still_where_no_way_leads_to_the_goal(two_rooms):
    assert (Oracle(0.6).plan(observe(two_rooms, (1.0, 3.0, 0.0), (5.0, 3.0))).path_m == 0).all()


def test_without_the_map_it_refuses():
    with pytest.raises(ValueError, match="needs the map"):
        Oracle(0.25).plan(Observation(step=0, goal_xy_m=np.ones(2), goal_frame=GoalFrame.CURRENT, pose=np.zeros(3)))
