import numpy as np
import pytest

from wsm_data.checks.path_shown import check_path_shown
from wsm_data.errors import Reason
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid


@pytest.mark.parametrize(("known", "kept"), [(10, True), (5, True), (4, False), (0, False)])
def test_a_path_may_lead_over_unknown_cells_up_to_the_limit(known, kept):
    """Ten positions in ten cells of a row, of which the first `known` ones were seen."""
    cells = np.full((1, 10), UNKNOWN, np.uint8)
    cells[0, :known] = OCCUPIED
    grid = OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05)
    path = np.column_stack([0.05 * np.arange(10) + 0.025, np.full(10, 0.025)])
    verdict = check_path_shown(grid, path, "hall/000000", 0.5)
    assert verdict.keep == kept
    assert verdict.measured["unknown_path_share"] == 1 - known / 10
    if not kept:
        assert (verdict.reason, verdict.measured["frame"]) == (Reason.PATH_OFF_MAP, known)
