"""How much of the floor around the way is not known."""

from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scorers.trajectory import Trajectory
from wsm_data.curation.scores_table import Direction, ScorerInfo
from wsm_data.maps.crop import crop_around
from wsm_data.maps.half_cells import nodes_near
from wsm_data.schema.occupancy import UNKNOWN

BAND_M = 1.0


def unknown_share(trajectory: Trajectory) -> float:
    """Share of the cells within 1 m of the path (centre to path) that are unknown."""
    grid = crop_around(trajectory.map, trajectory.path_xy_m, BAND_M)
    path = grid.fractional_cells(trajectory.path_xy_m) + 0.5
    band = nodes_near(path, grid.cells.shape, BAND_M / grid.resolution_m)[1::2, 1::2]
    return float((grid.cells[band] == UNKNOWN).mean())


UNKNOWN_SHARE = Scorer(
    info=ScorerInfo(
        name="map_unknown_share",
        unit="share",
        direction=Direction.HIGHER,
        summary=f"share of unknown cells within {BAND_M:g} m of the path",
    ),
    score=unknown_share,
)
