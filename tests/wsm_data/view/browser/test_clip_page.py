import json

import cv2
import numpy as np
import pytest

from wsm_data.view.browser.clip_page import clip_page, in_picture, map_picture


def test_a_page_gives_the_recorded_frames_and_the_path_on_the_map_with_north_up(clip, made):
    page = clip_page(clip)
    assert page["frames"] == made.frames - made.padded == len(page["distance_m"]) == len(page["map"]["path"])
    start_column, start_row = made.start_cell
    assert page["map"]["path"][0] == pytest.approx([start_column + 0.5, 40 - (start_row + 0.5)], abs=0.01)
    goal_column, goal_row = made.goal_cell
    assert page["map"]["goal"] == pytest.approx([goal_column + 0.5, 40 - (goal_row + 0.5)], abs=0.01)
    assert page["map"]["goal_radius"] == pytest.approx(0.2 / made.resolution_m)


def test_a_page_is_json_without_values_that_json_does_not_have(clip):
    json.dumps(clip_page(clip), allow_nan=False)


def test_a_clip_without_depth_says_so(made):
    page = clip_page(made.clip(depth_latent=None, depth_valid=None))
    assert not page["has_depth"]
    assert dict(page["facts"])["depth measured"] == "no depth"


def test_the_picture_of_the_map_is_a_pixel_a_cell_with_its_first_row_below(clip):
    picture = cv2.imdecode(np.frombuffer(map_picture(clip), np.uint8), cv2.IMREAD_UNCHANGED)
    cells = clip.occupancy[::-1]
    assert picture.shape == (*cells.shape, 4)
    assert np.array_equal(picture[..., 3] == 0, cells == 255)  # unknown is transparent
    wall = picture[0, 0]
    assert (picture[cells == 1] == wall).all()
    assert not (picture[cells == 0] == wall).all(axis=1).any()


def test_a_line_stands_where_the_distance_passes_a_whole_metre(clip, made):
    picture = cv2.imdecode(np.frombuffer(map_picture(clip), np.uint8), cv2.IMREAD_UNCHANGED)[::-1]
    row = int(made.goal_cell[1])  # straight left of the goal the field grows by 5 cm a cell, from 0 at 0.2 m
    lines = [column for column in range(1, 50) if (picture[row, column] == (209, 169, 127, 255)).all()]
    assert lines == [int(made.goal_cell[0]) - round((metres + 0.2) / 0.05) + 1 for metres in (2, 1)]


def test_a_place_is_measured_from_the_upper_left_corner(clip):
    left, bottom = clip.grid.origin_xy_m
    rows = clip.occupancy.shape[0]
    corner = np.array([[left, bottom + rows * clip.grid.resolution_m]])
    assert in_picture(clip.grid, corner) == pytest.approx(np.zeros((1, 2)), abs=1e-9)
