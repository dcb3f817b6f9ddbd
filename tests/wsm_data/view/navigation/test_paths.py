import cv2
import numpy as np

from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.view.navigation.paths import DrivenPath, draw_paths


def test_successes_are_drawn_blue_and_failures_red(tmp_path):
    grid = OccupancyGrid(cells=np.zeros((60, 80), np.uint8), origin_cell=(0, 0), resolution_m=0.05)

    def colours(success):
        way = DrivenPath(true_m=np.array([[0.5, 1.5], [3.5, 1.5]]), goal_m=np.array([3.5, 2.5]), success=success)
        draw_paths(tmp_path / "map.png", "scene $x$", grid, [way])
        picture = cv2.imread(str(tmp_path / "map.png"))[..., ::-1].reshape(-1, 3).astype(int)
        return [int((np.abs(picture - one).sum(axis=1) < 30).sum()) for one in ((31, 102, 177), (201, 40, 62))]

    blue, red = colours(True)
    assert blue > 300 > 10 > red
    blue, red = colours(False)
    assert red > 300 > 10 > blue
