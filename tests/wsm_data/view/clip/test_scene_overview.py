import numpy as np
import pytest

from wsm_data.schema.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from wsm_data.view.clip.scene_overview import joined_grid, scene_overview, scene_path


def grid(cells, origin_cell=(0, 0), resolution_m=0.05):
    return OccupancyGrid(cells=np.array(cells, np.uint8), origin_cell=origin_cell, resolution_m=resolution_m)


def test_crops_are_joined_on_the_worlds_grid():
    joined = joined_grid([grid([[FREE, FREE]], (5, 3)), grid([[OCCUPIED], [FREE]], (8, 2))])
    assert joined.origin_cell == (5, 2)
    assert joined.cells.tolist() == [[UNKNOWN, UNKNOWN, UNKNOWN, OCCUPIED], [FREE, FREE, UNKNOWN, FREE]]


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (FREE, OCCUPIED, OCCUPIED),
        (UNKNOWN, FREE, FREE),
        (UNKNOWN, OCCUPIED, OCCUPIED),
        (FREE, FREE, FREE),
        (UNKNOWN, UNKNOWN, UNKNOWN),
    ],
)
def test_occupied_wins_over_free_and_free_over_unknown_in_either_order(first, second, expected):
    assert joined_grid([grid([[first]]), grid([[second]])]).cells.tolist() == [[expected]]
    assert joined_grid([grid([[second]]), grid([[first]])]).cells.tolist() == [[expected]]


def test_maps_of_different_resolutions_are_not_joined():
    with pytest.raises(ValueError, match=r"0\.05, 0\.1"):
        joined_grid([grid([[FREE]]), grid([[FREE]], resolution_m=0.1)])


def test_an_overview_keeps_every_path(clip, made):
    other = made.clip("synth_zed/home_0001/000000")
    overview = scene_overview("synth/home_0001", [scene_path(clip, "train"), scene_path(other, "test")])
    assert [(path.key, path.split) for path in overview.paths] == [(clip.meta.key, "train"), (other.meta.key, "test")]
    assert np.array_equal(overview.grid.cells, clip.occupancy)
