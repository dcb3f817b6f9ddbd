"""Errors of trajectories."""

import numpy as np
import pytest

from wsm_data.metrics.trajectory import ate_rmse_unaligned_m
from wsm_model.evaluation.trajectory import constant_velocity, zero_motion

LINE = np.arange(9)[:, None] * np.array([0.1, 0.0, 0.2])


def test_the_error_is_the_root_of_the_mean_squared_distance():
    moved = LINE + np.array([3.0, 0.0, 4.0])
    assert ate_rmse_unaligned_m(moved, LINE) == pytest.approx(5.0)
    assert ate_rmse_unaligned_m(LINE, LINE) == 0.0


def test_a_straight_even_path_is_what_constant_velocity_says():
    assert ate_rmse_unaligned_m(constant_velocity(LINE), LINE) == pytest.approx(0.0, abs=1e-12)
    assert ate_rmse_unaligned_m(zero_motion(LINE), LINE) == pytest.approx(np.sqrt((LINE**2).sum(1).mean()))


def test_one_frame_has_no_velocity():
    assert constant_velocity(LINE[:1]).tolist() == [[0.0, 0.0, 0.0]]
