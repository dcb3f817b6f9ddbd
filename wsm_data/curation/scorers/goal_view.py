"""How much of the way the goal cannot be seen: behind walls, or outside the camera's field of view."""

import math

import numpy as np
from numba import njit

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.maps.sight import segment_is_clear
from wsm_data.schema.arrays import BoolArray, Float64Array
from wsm_data.schema.occupancy import OCCUPIED


def goal_behind_walls_share(trajectory: Trajectory) -> float:
    """Share of the way from which an occupied cell lies on the straight line to the goal.

    The line of sight is that of the maps (`maps.sight`): nothing is seen through the point where two occupied cells
    meet. A map knows no heights, so what the robot could look over hides the goal as a wall does; unknown cells hide
    nothing.
    """
    seen = _sees(trajectory.map.cells == OCCUPIED, trajectory.path_cells, trajectory.goal_cells)
    return min(1.0, math.fsum(trajectory.weights[~seen]))


def goal_out_of_view_share(trajectory: Trajectory) -> float:
    """Share of the way from which the goal lies outside the camera's horizontal field of view, walls or not.

    The goal's bearing from the optical axis is measured over the floor and projected as by a level camera. Positions in
    the goal region count as seeing it: a bearing means nothing there.
    """
    to_goal = trajectory.goal_xy_m - trajectory.path_xy_m
    bearing = np.arctan2(to_goal[:, 1], to_goal[:, 0]) - trajectory.heading_rad
    camera = trajectory.intrinsics
    left_rad = math.atan2(camera.cx + 0.5, camera.fx)  # the image spans -1/2 to width - 1/2
    right_rad = math.atan2(camera.width - 0.5 - camera.cx, camera.fx)
    bearing = np.arctan2(np.sin(bearing), np.cos(bearing))
    inside = (-right_rad <= bearing) & (bearing <= left_rad)
    arrived = trajectory.goal_distance_m <= trajectory.goal_radius_m
    return min(1.0, math.fsum(trajectory.weights[~(inside | arrived)]))


@njit(cache=True)  # type: ignore[untyped-decorator]
def _sees(opaque: BoolArray, points: Float64Array, goal: Float64Array) -> BoolArray:
    seen = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        seen[i] = segment_is_clear(opaque, points[i, 0], points[i, 1], goal[0], goal[1])
    return seen


GOAL_BEHIND_WALLS = Scorer(
    info=ScorerInfo(
        name="goal_behind_walls_share",
        unit="share",
        direction=Direction.HIGHER,
        summary="share of the path without a line of sight to the goal on the map",
    ),
    score=goal_behind_walls_share,
)
GOAL_OUT_OF_VIEW = Scorer(
    info=ScorerInfo(
        name="goal_out_of_view_share",
        unit="share",
        direction=Direction.HIGHER,
        summary="share of the path with the goal outside the horizontal field of view",
    ),
    score=goal_out_of_view_share,
)
