from dataclasses import replace

import numpy as np
import pytest

from wsm_data.curation.scorers.trajectory import map_with, trajectory_of
from wsm_data.schema.occupancy import UNKNOWN


def test_a_clip_gives_its_real_frames_in_the_world(make_clip):
    T = ((0.0, -1.0, 0.0, 2.0), (1.0, 0.0, 0.0, -1.0), (0.0, 0.0, 1.0, 0.5), (0.0, 0.0, 0.0, 1.0))
    clip = make_clip(latents=3, T_world_camera0=T, padded_frames=2)
    trajectory = trajectory_of(clip)
    assert trajectory.T_world_camera.shape == (7, 4, 4)
    assert trajectory.T_world_camera[0].tolist() == [list(row) for row in T]
    x, y = clip.poses[3, :2].astype(float)
    assert trajectory.path_xy_m[3] == pytest.approx([2.0 - y, -1.0 + x])
    assert trajectory.start_distance_m == clip.expert_distance[0]


def test_the_map_keeps_its_cells_and_grows_until_path_and_goal_are_inside(make_clip):
    clip = make_clip()
    grid = trajectory_of(clip).map
    x, y = (clip.meta.map_origin_cell[k] - grid.origin_cell[k] for k in range(2))
    rows, columns = clip.occupancy.shape
    assert np.array_equal(grid.cells[y : y + rows, x : x + columns], clip.occupancy)
    outside = np.ones(grid.cells.shape, bool)
    outside[y : y + rows, x : x + columns] = False
    assert (grid.cells[outside] == UNKNOWN).all()


def test_a_path_at_the_rim_of_its_map_is_refused(home):
    with pytest.raises(ValueError, match="at least a cell from its rim"):
        replace(home, goal_xy_m=np.array([100.0, 0.0]))


def test_weights_are_shares_of_the_way_and_equal_where_there_is_none(drive, floor):
    path = np.array([(1.0, 1.0), (2.0, 1.0), (2.0, 1.0), (4.0, 1.0)])
    assert drive(floor(6.0, 6.0), path, step_m=9.0).weights.tolist() == pytest.approx([1 / 6, 1 / 6, 1 / 3, 1 / 3])
    assert drive(floor(6.0, 6.0), path[1:3], step_m=9.0, goal_xy_m=(3.0, 3.0)).weights.tolist() == [0.5, 0.5]


def test_headings_are_those_of_the_optical_axis_without_jumps(drive, floor):
    wanted = np.linspace(2.0, 9.0, 40)
    trajectory = drive(floor(6.0, 6.0), np.full((40, 2), 3.0), heading_rad=wanted, goal_xy_m=(4.0, 4.0))
    assert trajectory.heading_rad == pytest.approx(wanted)


def test_a_map_that_holds_the_points_already_keeps_its_content(floor):
    grid = floor(2.0, 3.0)
    grown = map_with(grid, np.array([[1.0, 1.0]]))
    assert grown.cells.shape == (grid.cells.shape[0] + 2, grid.cells.shape[1] + 2)
    assert np.array_equal(grown.cells[1:-1, 1:-1], grid.cells)
