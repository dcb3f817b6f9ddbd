import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.view.clip.facts import (
    clip_facts,
    clip_field_m,
    depth_valid_share,
    path_clearance_m,
    world_path_m,
)

POSE_TOLERANCE_M = 1e-6  # poses are stored in float32


def test_the_path_stands_in_the_world_without_its_padding(clip, made):
    path_m = world_path_m(clip)
    start_xy_m = (made.start_cell + made.origin_cell + 0.5) * made.resolution_m
    assert path_m.shape == (made.frames - made.padded, 3)
    assert path_m[0] == pytest.approx([*start_xy_m, made.camera_height_m], abs=POSE_TOLERANCE_M)
    assert path_m[-1] == pytest.approx(clip.meta.goal_world_m, abs=POSE_TOLERANCE_M)


def test_facts_of_a_straight_path_are_those_of_its_geometry(clip, made):
    facts = clip_facts(clip)
    length_m = float(np.linalg.norm(made.goal_cell - made.start_cell)) * made.resolution_m
    assert facts.key == clip.meta.key
    assert (facts.frames, facts.padded_frames) == (made.frames - made.padded, made.padded)
    assert facts.path_length_m == pytest.approx(length_m, abs=1e-5)
    assert facts.start_distance_m == pytest.approx(length_m - 0.2, abs=1e-6)
    assert facts.detour == pytest.approx(1.0, abs=1e-5)
    assert facts.camera_pitch_deg == pytest.approx(np.rad2deg(0.1))
    assert facts.map_area_m2 == pytest.approx(40 * 60 * 0.05**2)
    assert facts.map_unknown_share == pytest.approx(9 * 9 / (40 * 60))


def test_clearance_is_to_the_wall_at_the_start_and_at_most_to_the_pillar(clip):
    facts = clip_facts(clip)
    # The start is in column 8: 7.5 cells from the face of the wall in column 0. Positions further on come nearer to
    # the pillar that begins in row 25: where the path passes column 29 it is in row 16, so 8.5 cells below its face.
    assert facts.clearance_min_m == pytest.approx(7.5 * 0.05, abs=1e-5)
    assert facts.clearance_min_m < facts.clearance_median_m < 12 * 0.05


def test_a_map_without_obstacles_has_no_clearance(made):
    clip = made.clip(occupancy=np.zeros((40, 60), np.uint8))
    assert clip_facts(clip).clearance_median_m is None
    assert clip_facts(clip).clearance_min_m is None


def test_a_start_within_the_goal_region_has_no_detour(made):
    clip = made.clip(goal_radius_m=30.0)
    assert clip_facts(clip).detour is None


def test_unreachable_cells_have_no_distance(clip):
    field_m = clip_field_m(clip)
    assert np.array_equal(np.isnan(field_m), clip.geodesic_mm == 65535)
    assert field_m[12, 8] == pytest.approx(clip.geodesic_mm[12, 8] / 1000)


def test_the_grid_of_a_clip_is_where_its_meta_data_says(clip, made):
    grid = clip.grid
    assert grid.origin_xy_m == pytest.approx((-0.5, 1.0))
    assert np.array_equal(grid.cells, clip.occupancy)


def test_padding_does_not_count_towards_measured_depth(made):
    depth_valid = np.full((4, 2, 4), 255, np.uint8)
    depth_valid[3] = 0  # 4 of 13 frames are padding: the last latent holds nothing else
    assert depth_valid_share(made.clip(depth_valid=depth_valid)) == 1.0
    assert depth_valid_share(made.clip(depth_valid=depth_valid, padded_frames=3)) == pytest.approx(0.75)


@given(st.integers(0, 2**32 - 1))
def test_clearance_is_the_least_distance_to_any_occupied_square(seed):
    rng = np.random.default_rng(seed)
    cells = (rng.random((9, 12)) < 0.3).astype(np.uint8)
    cells[4, 4] = 1
    grid = OccupancyGrid(cells=cells, origin_cell=(int(rng.integers(-5, 5)), 3), resolution_m=0.1)
    low = np.array(grid.origin_xy_m)
    points = low + rng.random((5, 2)) * [1.2, 0.9]

    def slow(point):
        corners = low + np.argwhere(cells.T == 1) * 0.1
        return min(
            np.linalg.norm(np.maximum(0, np.maximum(corner - point, point - corner - 0.1))) for corner in corners
        )

    assert path_clearance_m(grid, points) == pytest.approx([slow(point) for point in points], abs=1e-9)
