import numpy as np
import pytest
import torch

from wsm_data.loaders.batches.query_batch import QueryBatch
from wsm_data.schema.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid

SHAPES = ((40, 60), (30, 44))
GRIDS = [
    OccupancyGrid(cells=np.full(shape, OCCUPIED, np.uint8), origin_cell=origin_cell, resolution_m=0.05)
    for shape, origin_cell in zip(SHAPES, ((-17, 3), (5, -8)), strict=True)
]


@pytest.fixture(scope="module")
def batch():
    """Two maps of different sizes in one batch; what has nothing to do with maps is left out."""
    occupancy, geodesic_mm = np.full((2, 40, 60), UNKNOWN, np.uint8), np.full((2, 40, 60), 65535, np.uint16)
    for number, (rows, columns) in enumerate(SHAPES):
        occupancy[number, :rows, :columns] = OCCUPIED
        geodesic_mm[number, :rows, :columns] = number
    nothing = torch.zeros(2)
    return QueryBatch(
        history=None,
        replan_latent=nothing,
        occupancy=torch.from_numpy(occupancy),
        geodesic_mm=torch.from_numpy(geodesic_mm),
        map_shape=torch.tensor(SHAPES),
        map_origin_m=torch.tensor([grid.origin_xy_m for grid in GRIDS], dtype=torch.float64),
        resolution_m=torch.full((2,), 0.05, dtype=torch.float64),
        T_world_camera0=nothing,
        T_world_camera=nothing,
        goal_world_m=nothing,
        goal_radius_m=nothing,
        robot_radius_m=torch.tensor([0.1, 0.2], dtype=torch.float64),
        expert_distance_m=nothing,
    )


@pytest.mark.parametrize("number", [0, 1])
def test_a_map_comes_back_as_it_was_without_the_padding(batch, number):
    found = batch.map_of(number)
    np.testing.assert_array_equal(found.grid.cells, GRIDS[number].cells)
    assert found.grid.origin_cell == GRIDS[number].origin_cell
    assert found.grid.resolution_m == 0.05
    assert found.robot_radius_m == [0.1, 0.2][number]
    np.testing.assert_array_equal(found.geodesic_mm, np.full(SHAPES[number], number))
