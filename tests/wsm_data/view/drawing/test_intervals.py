import io

import numpy as np
import pytest
from PIL import Image

from wsm_data.view.drawing.intervals import Bar, draw_intervals


def pixels(path):
    return np.asarray(Image.open(io.BytesIO(path.read_bytes())).convert("RGB")).astype(int)


def bar(value, interval=None):
    return Bar(name="a", value=value, interval=interval, muted=False)


def test_an_interval_is_drawn_over_its_bar_and_each_row_makes_the_picture_taller(tmp_path):
    path = tmp_path / "bars.png"
    draw_intervals({"SR %": [bar(50.0)]}, "t", path)
    plain = pixels(path)
    draw_intervals({"SR %": [bar(50.0, (20.0, 50.0))]}, "t", path)
    assert pixels(path).shape == plain.shape
    assert (pixels(path) != plain).any()
    draw_intervals({"SR %": [bar(50.0), bar(30.0)]}, "t", path)
    assert len(pixels(path)) == len(plain) + 30


def test_a_picture_of_nothing_is_refused(tmp_path):
    with pytest.raises(ValueError, match="at least one number"):
        draw_intervals({}, "t", tmp_path / "bars.png")
