import numpy as np
import pytest

from wsm_data.curation.scorers.path_length import path_length_m


def test_it_is_the_sum_of_the_legs_whatever_the_frame_rate(drive, floor):
    way = [(1.0, 1.0), (4.0, 1.0), (4.0, 5.0)]
    for step_m in (0.01, 0.04, 0.5):
        assert path_length_m(drive(floor(6.0, 6.0), way, step_m=step_m)) == pytest.approx(7.0, abs=1e-9)


def test_a_camera_that_stands_still_has_come_nowhere(drive, floor):
    assert path_length_m(drive(floor(6.0, 6.0), [(1.0, 1.0)], goal_xy_m=(2.0, 1.0))) == 0.0


def test_heights_do_not_count(drive, floor):
    trajectory = drive(floor(6.0, 6.0), [(1.0, 1.0), (3.0, 1.0)])
    T = trajectory.T_world_camera.copy()
    T[:, 2, 3] += np.linspace(0, 1, len(T))
    lifted = type(trajectory)(**{**vars_of(trajectory), "T_world_camera": T})
    assert path_length_m(lifted) == pytest.approx(2.0)


def vars_of(trajectory):
    return {name: getattr(trajectory, name) for name in trajectory.__dataclass_fields__}
