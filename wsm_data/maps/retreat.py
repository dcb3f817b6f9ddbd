"""How far one must move away from a goal to reach it: dead ends and detours as straight distance feels them."""

import numpy as np

from wsm_data.maps.bottleneck import flood_levels
from wsm_data.maps.footprint import traversable
from wsm_data.maps.half_cells import nodes_near
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import OccupancyGrid


def necessary_retreat_m(
    grid: OccupancyGrid, path_xy_m: Float64Array, goal_xy_m: Float64Array, robot_radius_m: float, goal_radius_m: float
) -> Float64Array:
    """How much farther from the goal than a position the best way from there to the goal has to lead.

    The best way is the one whose farthest point from the goal, in a straight line, is nearest. 0 means that some way
    never leads away from the goal; behind the back wall of a dead end of depth d it is about d. It is the depth of the
    local minimum of the straight-line distance that a robot which drives straight at the goal is caught in.

    Ways lead where the robot's centre may be, and over the cells of the path itself, which is passable by proof.

    Args:
        grid: the map; the whole path must lie inside it.
        path_xy_m: the expert's positions, which end in the goal region, world, m; [N, 2].
        goal_xy_m: the goal, world, m; [2].
        robot_radius_m: radius of the footprint, m.
        goal_radius_m: radius of the goal region, m.

    Returns:
        float64 [N], m, measured between centres of cells; infinite where no way leads to the goal region.
    """
    path, goal = grid.fractional_cells(path_xy_m) + 0.5, grid.fractional_cells(goal_xy_m) + 0.5
    passable = traversable(grid, robot_radius_m) | nodes_near(path, grid.cells.shape, np.sqrt(0.5))[1::2, 1::2]
    rows, columns = np.ogrid[: grid.cells.shape[0], : grid.cells.shape[1]]
    distance = np.hypot(columns + 0.5 - goal[0], rows + 0.5 - goal[1])
    column, row = np.floor(path).astype(np.int64).T
    wanted = np.zeros(grid.cells.shape, bool)
    wanted[row, column] = True
    seeds = distance <= max(goal_radius_m / grid.resolution_m, np.sqrt(0.5))
    level = flood_levels(distance, passable, seeds, wanted)
    return (level[row, column] - distance[row, column]) * grid.resolution_m
