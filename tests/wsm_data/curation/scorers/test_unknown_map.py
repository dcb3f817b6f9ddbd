import numpy as np
import pytest

from wsm_data.curation.scorers.unknown_map import BAND_M, unknown_share
from wsm_data.schema.occupancy import FREE, UNKNOWN, OccupancyGrid


def half_known(edge_m):
    """A floor of 8 m x 8 m, unknown from a height on."""
    cells = np.full((160, 160), FREE, np.uint8)
    cells[round(edge_m / 0.05) :] = UNKNOWN
    return OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)


def test_it_counts_the_cells_within_a_metre_of_the_path(drive):
    grid = half_known(4.5)
    trajectory = drive(grid, [(2.0, 4.0), (6.0, 4.0)])
    rows, columns = np.mgrid[:160, :160]
    x, y = (columns + 0.5) * 0.05, (rows + 0.5) * 0.05
    near = np.hypot(np.maximum(np.maximum(2.0 - x, x - 6.0), 0), y - 4.0) <= BAND_M
    assert unknown_share(trajectory) == pytest.approx((near & (y > 4.5)).sum() / near.sum(), abs=1e-12)


def test_the_more_is_unknown_the_harder(drive):
    found = [unknown_share(drive(half_known(edge_m), [(2.0, 4.0), (6.0, 4.0)])) for edge_m in (5.5, 4.8, 4.4, 4.1)]
    assert found == sorted(found)
    assert found[0] == 0.0


def test_what_the_map_does_not_reach_is_unknown(drive):
    cells = np.full((40, 40), FREE, np.uint8)  # 2 m x 2 m
    grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)
    assert unknown_share(drive(grid, [(0.0, 1.0), (0.001, 1.0)])) == pytest.approx(0.5, abs=0.01)
