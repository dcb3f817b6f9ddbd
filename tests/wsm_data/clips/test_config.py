import numpy as np
import pytest

from wsm_data.clips.config import MIN_GOAL_RADIUS_M, ClipConfig
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config
from wsm_data.maps.geodesic import geodesic_distance
from wsm_data.maps.progress import sample_distance
from wsm_data.schema.occupancy import OccupancyGrid


def test_the_defaults_are_the_papers():
    config = ClipConfig()
    assert (config.width, config.height) == (320, 192)
    assert (config.depth_range.min_m, config.depth_range.max_m) == (0.2, 5.0)
    assert (config.goal_radius_m, config.still_frames) == (0.2, 16)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 310}, "multiples of 32 px, found 310 and 192"),
        ({"height": 0}, "multiples of 32 px, found 320 and 0"),
        ({"still_frames": 6}, "a multiple of 4, found 6"),
        ({"still_frames": -4}, "a multiple of 4, found -4"),
        ({"goal_radius_m": 0.05}, "at least 0.071 m, the diagonal of a map cell, found 0.05"),
        ({"map_margin_m": -0.1}, "must not be negative, found -0.1"),
        ({"fill_holes_cells": -1}, "fill_holes_cells must not be negative, found -1"),
        ({"depth_range": {"min_m": 5.0}}, "0 < min_m < max_m, found 5.0 and 5.0"),
    ],
)
def test_what_would_fail_in_the_middle_of_the_work_is_refused_before_it(values, message):
    with pytest.raises(ConfigError, match=message):
        build_config(ClipConfig, values)


def test_the_last_distance_is_zero_with_the_smallest_goal_region_wherever_in_its_cell_the_expert_stops():
    grid = OccupancyGrid(cells=np.zeros((9, 9), np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    for offset in np.random.default_rng(0).uniform(0, 0.05, (50, 2)):
        goal = 0.2 + offset
        field_m = geodesic_distance(grid, goal, 0.0, MIN_GOAL_RADIUS_M)
        assert sample_distance(field_m, grid, goal[None])[0] == 0.0
