import cv2
import numpy as np
import pytest

from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.view.navigation.film import FilmFrame, film_picture, write_film

GOAL = np.array([4.0, 2.0])


@pytest.fixture
def grid():
    """8 x 4 m, all free: its picture is 900 px wide, so that a metre is 112.5 px."""
    return OccupancyGrid(cells=np.zeros((80, 160), np.uint8), origin_cell=(0, 0), resolution_m=0.05)


def frame(dreamed=None):
    way = np.array([[1.0, 1.0], [2.0, 1.0]])
    return FilmFrame(
        seen_u8=np.full((36, 64, 3), (200, 10, 10), np.uint8),
        beside_u8=dreamed,
        true_m=way,
        estimated_m=way + np.array([0.0, 1.5]),
        caption=("a", "b"),
    )


def test_what_is_seen_stands_beside_what_is_dreamed_and_the_map_below(grid):
    background = np.full((450, 960, 3), 255, np.uint8)
    picture = film_picture(background, grid, GOAL, frame(np.full((64, 96, 3), (0, 0, 99), np.uint8)))
    assert picture.shape == (720, 960, 3)
    assert picture[100, 100].tolist() == [200, 10, 10]
    assert picture[100, 700].tolist() == [0, 0, 99]
    left, below = 30 + 112.5, 270 + 450  # the map stands in the middle, its lower edge at the picture's
    assert picture[round(below - 112.5), round(left + 112.5 / 2)].tolist() == [201, 40, 62]
    assert picture[round(below - 2.5 * 112.5), round(left + 112.5 / 2)].tolist() == [31, 102, 177]


def test_a_film_has_a_frame_for_each_and_nothing_is_left_beside_it(tmp_path, grid):
    path = tmp_path / "films" / "one.mp4"
    assert write_film(path, grid, GOAL, iter([frame()] * 3)) == 3
    reader = cv2.VideoCapture(str(path))
    shapes = []
    while (read := reader.read())[0]:
        shapes.append(read[1].shape)
    assert shapes == [(720, 960, 3)] * 3
    assert [one.name for one in path.parent.iterdir()] == ["one.mp4"]


def test_a_film_that_breaks_off_leaves_none(tmp_path, grid):
    def frames():
        yield frame()
        raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        write_film(tmp_path / "one.mp4", grid, GOAL, frames())
    assert list(tmp_path.iterdir()) == []


def test_a_square_picture_stands_in_the_middle_undistorted(grid):
    background = np.full((450, 960, 3), 255, np.uint8)
    picture = film_picture(background, grid, GOAL, frame(np.full((540, 540, 3), (0, 0, 99), np.uint8)))
    inside = (picture[135, 480:] == (0, 0, 99)).all(axis=1)
    assert np.flatnonzero(inside)[[0, -1]].tolist() == [105, 374]  # 270 px wide as it is high: (480 - 270) / 2
