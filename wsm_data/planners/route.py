"""The way from one place of a map to another, in metres."""

import numpy as np

from wsm_data.maps.footprint import clearance_m
from wsm_data.planners.costs import cheapest_way, shortened
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import OccupancyGrid

_CORRIDOR_M, _CORRIDOR_CHECKS = 1.0, 41


def find_route(
    grid: OccupancyGrid, price: Float64Array, start_xy_m: Float64Array, goal_xy_m: Float64Array
) -> Float64Array | None:
    """Corners of the cheapest way from start to goal.

    Args:
        grid: the map; start and goal are moved to its nearest cells where they lie outside.
        price: of its cells (`costs.prices`); float64 [Y, X].
        start_xy_m: where the robot is, m; [2].
        goal_xy_m: where it shall be, m; [2].

    Returns:
        float64 [N, 2] in the map's frame, the goal last, the start left out, m; None where there is no way.
    """
    start, goal = _cell(grid, start_xy_m), _cell(grid, goal_xy_m)
    cells = cheapest_way(price, start, goal)
    if not len(cells):
        return None
    corners = grid.cell_centres_xy_m(shortened(price, cells)[:, ::-1].astype(np.float64))
    return np.concatenate([corners[1:-1], goal_xy_m[None]])


def free_corridor_m(grid: OccupancyGrid, pose: Float64Array, radius_m: float) -> float:
    """How far a disc at a pose (x, y, heading) can go straight ahead until it touches what is occupied, at most 1 m."""
    along = np.linspace(0.0, _CORRIDOR_M, _CORRIDOR_CHECKS)
    places = pose[:2] + along[:, None] * np.array([np.cos(pose[2]), np.sin(pose[2])])
    touching = np.flatnonzero(clearance_m(grid, places) < radius_m)
    return float(along[touching[0]]) if len(touching) else _CORRIDOR_M


def _cell(grid: OccupancyGrid, xy_m: Float64Array) -> tuple[int, int]:
    column, row = np.floor(grid.fractional_cells(xy_m) + 0.5).astype(int).tolist()
    rows, columns = grid.cells.shape
    return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)
