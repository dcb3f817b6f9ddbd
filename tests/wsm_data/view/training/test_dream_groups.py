"""Two dreams on an open floor, one of them into a wall."""

import cv2
import numpy as np

from wsm_data.schema.occupancy import FREE, OCCUPIED, OccupancyGrid
from wsm_data.view.training.dream_groups import DreamGroup, draw_dream_groups


def test_a_group_is_drawn_with_its_colours(tmp_path):
    cells = np.full((60, 60), FREE, np.uint8)
    cells[:, 40] = OCCUPIED
    group = DreamGroup(
        title="home_0001/000000 at 3",
        grid=OccupancyGrid(cells=cells, origin_cell=(0, 0), resolution_m=0.05),
        geodesic_mm=np.full((60, 60), 65535, np.uint16),
        start_xy_m=np.array([1.0, 1.0]),
        paths_xy_m=np.array([[[1.1, 1.2], [1.2, 1.6]], [[1.5, 1.0], [2.2, 1.0]]]),
        safe=np.array([True, False]),
        reward=np.array([1.0, 0.0]),
    )
    draw_dream_groups([group, group], "groups of step 1", tmp_path / "groups.png")
    picture = cv2.imread(str(tmp_path / "groups.png"))[..., ::-1]
    for colour in (
        (0x0B, 0x3C, 0x6F),
        (0xC9, 0x28, 0x3E),
        (0x37, 0x43, 0x4D),
    ):  # the best, an unsafe one, a wall; thin lines are blended
        assert (np.abs(picture.astype(int) - colour).max(axis=-1) < 60).any()
