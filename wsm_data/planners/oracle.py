"""The expert: it knows the map and where it is."""

import numpy as np

from wsm_data.geometry.planar import compose, points_from_base, points_in_base
from wsm_data.planners.costs import Caution, prices
from wsm_data.planners.planner import Observation, Plan, goal_in_base
from wsm_data.planners.route import find_route, free_corridor_m
from wsm_data.planners.steering import Steering
from wsm_data.schema.arrays import Float64Array

_CAUTION = Caution(margin_m=0.05, comfort_m=0.12)


class Oracle:
    """Follows the cheapest way over the true map, which it finds anew at every observation.

    Args:
        radius_m: radius of the robot, m.
    """

    def __init__(self, radius_m: float):
        self._radius_m = radius_m
        self._price: Float64Array | None = None
        self._steering = Steering()

    def plan(self, observation: Observation) -> Plan:
        """Answer to one observation; a goal that no way leads to is answered with standing still."""
        known = observation.known_map
        if known is None or observation.pose is None:
            raise ValueError("the oracle needs the map and the pose")
        if self._price is None:
            self._price = prices(known.grid, self._radius_m, _CAUTION, through_unknown=False)
        here = compose(known.start_pose, observation.pose)
        goal = points_from_base(goal_in_base(observation)[None], here)[0]
        way = find_route(known.grid, self._price, here[:2], goal)
        if way is None:
            return Plan(path_m=np.zeros((2, 2)))
        free_m = free_corridor_m(known.grid, here, self._radius_m)
        return Plan(path_m=self._steering.path(points_in_base(way, here), observation.step, free_m))
