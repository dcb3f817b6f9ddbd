import cv2
import numpy as np

from wsm_data.view.navigation.estimated_paths import draw_estimated_paths


def test_the_true_way_is_red_and_the_aligned_one_blue_with_forward_up(tmp_path):
    ahead = np.array([[0, 0, 0], [0, 5, 1], [0, 5, 2.0]])  # 2 m forward; height is not shown
    right = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])
    draw_estimated_paths(tmp_path / "p.png", "$x$", {"true": ahead, "estimated, aligned": right})
    picture = cv2.imread(str(tmp_path / "p.png"))[..., ::-1].astype(int)[:540]  # without the legend below

    def extent(colour):
        rows, columns = np.nonzero(np.abs(picture - colour).sum(axis=2) < 40)
        return np.ptp(rows), np.ptp(columns)

    rows, columns = extent((201, 40, 62))
    assert rows > 200 > 20 > columns
    rows, columns = extent((31, 102, 177))
    assert columns > 200 > 20 > rows
