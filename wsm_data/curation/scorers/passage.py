"""The narrowest passage that the way must squeeze through."""

import numpy as np

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import CLEARANCE_CAP_M, Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.maps.bottleneck import flood_levels
from wsm_data.maps.crop import crop_around
from wsm_data.maps.half_cells import half_cell_clearance, nodes_near

CORRIDOR_M = 0.6
"""Ways this near to the expert's are taken for the same way. That reaches the middle of any passage of up to 1.7 m, for
the expert keeps at least its own radius of 0.25 m from both sides."""

END_M = 0.5
"""What lies this near to start and goal is not passed through: a robot may well set out from beside a wall."""

_CAP_M = CLEARANCE_CAP_M - CORRIDOR_M


def narrowest_passage_m(trajectory: Trajectory) -> float:
    """Diameter of the largest disc that can be moved along the expert's way, m; at most 2.8.

    Twice the clearance at the bottleneck of the widest path (Pollack 1960, see `maps.bottleneck`) from the
    neighbourhood of the start to that of the goal, among the points of the map within 0.6 m of the expert's path. So a
    doorway counts with its own width however far from its middle, and at whatever angle, the expert drives through. It
    is a whole number of map cells for walls along the axes, and 0 where the path itself meets an obstacle.
    """
    grid = crop_around(trajectory.map, trajectory.path_xy_m, CLEARANCE_CAP_M)
    path, shape, cell_m = grid.fractional_cells(trajectory.path_xy_m) + 0.5, grid.cells.shape, grid.resolution_m
    clearance = np.minimum(half_cell_clearance(grid.cells), _CAP_M / cell_m)
    corridor = nodes_near(path, shape, CORRIDOR_M / cell_m) & (clearance > 0)
    start = nodes_near(path[:1], shape, END_M / cell_m)
    goal = nodes_near(path[-1:], shape, END_M / cell_m) & corridor
    reached = flood_levels(-clearance, corridor, start, goal)[goal]
    widest = -float(reached.min(initial=0.0))
    return 2 * cell_m * widest


NARROWEST_PASSAGE = Scorer(
    info=ScorerInfo(
        name="passage_narrowest_m",
        unit="m",
        direction=Direction.LOWER,
        summary=f"width of the narrowest passage on the way, at most {2 * _CAP_M:g} m",
    ),
    score=narrowest_passage_m,
)
