"""The commands against those measured on the benchmark's own controller (casadi 3.7, IPOPT), to 1e-3."""

import numpy as np
import pytest

from wsm_data.sim.base import drive_arc
from wsm_data.sim.tracking.controller import TrackingController

COUNT = np.arange(1, 25)


def straight(bearing_deg, spacing_m=0.25):
    bearing = np.radians(bearing_deg)
    return spacing_m * np.column_stack([COUNT * np.cos(bearing), COUNT * np.sin(bearing)])


def arc():
    angle = np.linspace(0.05, 1.5, 24)
    return np.column_stack([np.sin(angle), 1 - np.cos(angle)])


@pytest.mark.parametrize(
    ("path", "pose", "wanted"),
    [
        (straight(0), (0, 0, 0), (0.5, 0)),
        (straight(0), (0, 0.2, 0.3), (0.5, -0.5)),
        (straight(0), (0, 0, np.pi / 2), (0, -0.5)),
        (arc(), (0, 0, 0), (0.5, 0.4532)),
        (straight(60), (0, 0, 0), (0.5, 0.5)),
        (straight(80), (0, 0, 0), (0, 0.5)),
        (straight(90), (0, 0, 0), (0, 0.5)),
        (np.tile([0.0, 1.0], (24, 1)), (0, 0, 0), (0, 0.5)),
        (np.tile([0.0, -1.0], (24, 1)), (0, 0, 0), (0, -0.5)),
        (np.zeros((24, 2)), (0, 0, 0), (0, 0)),
        (straight(0, 0.0125), (0, 0, 0), (0.5, 0)),
    ],
)
def test_the_command_is_the_measured_one(path, pose, wanted):
    found = TrackingController(path, 0.5).command(np.array(pose, np.float64))
    np.testing.assert_allclose(found, wanted, atol=1e-3)


@pytest.mark.parametrize("spacing_m", [0.05, 0.1, 0.15, 0.2, 0.25])
@pytest.mark.parametrize("bearing_deg", [95, 110, 135, 160, 180, -95, -150])
def test_a_straight_path_behind_is_a_trap_in_which_the_base_neither_turns_nor_moves(bearing_deg, spacing_m):
    found = TrackingController(straight(bearing_deg, spacing_m), 0.5).command(np.zeros(3))
    np.testing.assert_allclose(found, (0, 0), atol=1e-3)


def test_twelve_steps_in_closed_loop_are_the_measured_ones():
    controller, pose, turns = TrackingController(straight(0), 0.5), np.array([0.0, 0.2, 0.3]), []
    for step in range(12):
        speed, turn = controller.command(pose)
        pose = drive_arc(pose, speed, turn, 0.15)
        assert speed == pytest.approx(0.5, abs=1e-3)
        turns.append(turn)
        if step == 6:
            np.testing.assert_allclose(pose, (0.5186, 0.2195, -0.225), atol=1e-3)
    np.testing.assert_allclose(turns, [-0.5] * 7 + [-0.3602, -0.2149, -0.0945, 0.0029, 0.0793], atol=1e-3)
    np.testing.assert_allclose(pose, (0.8765, 0.1080, -0.3131), atol=1e-3)


@pytest.mark.parametrize("path", [np.zeros((1, 2)), np.zeros((5, 3)), np.full((5, 2), np.nan)])
def test_what_is_no_path_is_refused(path):
    with pytest.raises(ValueError, match="path"):
        TrackingController(path, 0.5)
