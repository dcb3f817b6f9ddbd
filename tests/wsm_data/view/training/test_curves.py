"""Curves of a run."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.view.training.curves import draw_training_curves, smoothed

UNITS = {"loss": "sum (1)", "depth": "squared error (1)", "learning_rate": "rate (1)"}


def records(steps: int) -> list[dict[str, float]]:
    return [
        {"step": step, "loss": 1 / step, "depth": 0.5, "learning_rate": 1e-3, "seconds": 1.0}
        for step in range(1, steps)
    ]


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=30), st.integers(1, 40))
def test_smoothing_is_the_mean_of_the_last_values(values, window):
    wanted = [np.mean(values[max(0, end - window) : end]) for end in range(1, len(values) + 1)]
    np.testing.assert_allclose(smoothed(np.array(values), window), wanted, atol=1e-9)  # sums of 30 numbers up to 10


def test_a_picture_has_a_panel_for_each_name_that_was_logged(tmp_path):
    draw_training_curves(records(50), UNITS, tmp_path / "curves.png")
    three = cv2.imread(str(tmp_path / "curves.png"))
    draw_training_curves(records(50), UNITS | {"flow": "not logged"}, tmp_path / "same.png")
    assert three.shape == (300, 1440, 3)
    assert (tmp_path / "same.png").read_bytes() == (tmp_path / "curves.png").read_bytes()


def test_what_is_measured_now_and_then_has_a_panel_of_its_own_steps(tmp_path):
    now_and_then = [{"step": step, "held_out": 1 / step} for step in (10, 20, 30)]
    units = UNITS | {"held_out": "error (1)"}
    draw_training_curves(records(50) + now_and_then, units, tmp_path / "both.png")
    assert cv2.imread(str(tmp_path / "both.png")).shape == (600, 1440, 3)
    draw_training_curves(records(50) + now_and_then, UNITS, tmp_path / "one.png")
    draw_training_curves(records(50), UNITS, tmp_path / "same.png")
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "same.png").read_bytes()


def test_equal_runs_give_equal_bytes_and_other_numbers_another_picture(tmp_path):
    for name, count in (("a", 50), ("b", 50), ("c", 40)):
        draw_training_curves(records(count), UNITS, tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes() != (tmp_path / "c").read_bytes()


def test_a_run_without_a_step_has_no_curves(tmp_path):
    with pytest.raises(ValueError, match="without a logged step"):
        draw_training_curves([], UNITS, tmp_path / "curves.png")
