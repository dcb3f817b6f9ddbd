import numpy as np
import pytest

from wsm_data.sim.base import CONTROL_STEP_S, drive_arc


@pytest.mark.parametrize(("speed", "turn_rate"), [(0.5, 0.5), (0.5, -0.3), (0.2, 0.0), (0.0, 0.5), (0.5, 1e-12)])
def test_an_arc_is_what_many_small_straight_steps_come_to(speed, turn_rate):
    pose, steps = np.array([1.0, -2.0, 0.7]), 20_000
    slow = pose.copy()
    for _ in range(steps):
        slow += np.array([speed * np.cos(slow[2]), speed * np.sin(slow[2]), turn_rate]) * (1.5 / steps)
    np.testing.assert_allclose(drive_arc(pose, speed, turn_rate, 1.5), slow, atol=1e-4)


def test_two_halves_of_a_step_make_the_step():
    pose = np.array([0.0, 0.0, 3.0])
    half = drive_arc(pose, 0.4, 0.5, CONTROL_STEP_S / 2)
    whole = drive_arc(pose, 0.4, 0.5, CONTROL_STEP_S)
    np.testing.assert_allclose(drive_arc(half, 0.4, 0.5, CONTROL_STEP_S / 2), whole, atol=1e-15)
    assert (pose == (0.0, 0.0, 3.0)).all()
