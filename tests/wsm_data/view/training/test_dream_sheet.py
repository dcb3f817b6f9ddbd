"""A dream beside the truth."""

import cv2
import numpy as np
import pytest

from wsm_data.schema.depth import DepthRange
from wsm_data.view.drawing.depth_colours import depth_picture
from wsm_data.view.training.dream_sheet import DreamSheet, draw_dream_sheet


def sheet(**changes: object) -> DreamSheet:
    rng = np.random.default_rng(0)
    path = np.cumsum(rng.normal(size=(9, 3)), axis=0)
    values = {
        "title": "after step 5",
        "frames": (4, 6, 8),
        "true_rgb_u8": np.full((3, 24, 40, 3), (200, 30, 30), np.uint8),
        "dreamed_rgb_u8": np.full((3, 24, 40, 3), (30, 30, 200), np.uint8),
        "true_depth_m": np.full((3, 24, 40), 1.0, np.float32),
        "estimated_depth_m": np.full((3, 24, 40), 4.0, np.float32),
        "depth_range": DepthRange(),
        "true_path_m": path,
        "estimated_path_m": path[:5],
        "dreamed_path_m": path[4:],
    }
    return DreamSheet(**(values | changes))


def share_of_colour(picture: np.ndarray, colour: tuple[int, int, int]) -> float:
    """Share of pixels within 6 of a colour (RGB); scaling a plain picture leaves its colour."""
    return float((np.abs(picture[..., ::-1].astype(int) - colour).max(-1) <= 6).mean())


def test_seen_and_dreamed_pictures_stand_on_the_sheet_in_equal_size(tmp_path):
    draw_dream_sheet(sheet(), tmp_path / "sheet.png")
    picture = cv2.imread(str(tmp_path / "sheet.png"))
    seen, dreamed = share_of_colour(picture, (200, 30, 30)), share_of_colour(picture, (30, 30, 200))
    assert seen == pytest.approx(dreamed, rel=0.02)
    assert seen == pytest.approx(3 * 240 * 144 / picture[..., 0].size, rel=0.05)


def test_the_same_sheet_gives_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        draw_dream_sheet(sheet(), tmp_path / name)
    draw_dream_sheet(sheet(estimated_depth_m=np.full((3, 24, 40), 1.0, np.float32)), tmp_path / "c")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes() != (tmp_path / "c").read_bytes()


def test_a_model_without_depth_has_no_row_of_estimates(tmp_path):
    draw_dream_sheet(sheet(estimated_depth_m=np.full((3, 24, 40), 1.0, np.float32)), tmp_path / "with.png")
    draw_dream_sheet(sheet(estimated_depth_m=None), tmp_path / "without.png")
    pictures = [cv2.imread(str(tmp_path / name)) for name in ("with.png", "without.png")]
    colour = tuple(int(x) for x in depth_picture(np.full((1, 1, 1), 1.0, np.float32), DepthRange())[0, 0, 0])
    shares = [share_of_colour(picture, colour) for picture in pictures]
    assert shares[1] == pytest.approx(shares[0] / 2, rel=0.05)  # true and estimated are of one colour


def test_pictures_of_another_count_are_refused():
    with pytest.raises(ValueError, match="dreamed_rgb_u8"):
        sheet(dreamed_rgb_u8=np.zeros((2, 24, 40, 3), np.uint8))
