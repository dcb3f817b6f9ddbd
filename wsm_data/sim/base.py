"""The differential base: how a pose follows from a command."""

import math

from wsm_data.schema.arrays import Float64Array

CONTROL_STEP_S = 0.15
"""Time for which a command is held, s."""


def drive_arc(pose: Float64Array, speed: float, turn_rate: float, seconds: float) -> Float64Array:
    """The exact pose after a constant command: a circular arc, or a straight line.

    Args:
        pose: x, y (m) and heading (rad, not wrapped); [3].
        speed: m/s along the heading.
        turn_rate: rad/s, to the left.
        seconds: how long the command is held, s.

    Returns:
        x, y and heading; float64 [3].
    """
    turned = turn_rate * seconds
    chord = speed * seconds * _sinc(turned / 2)
    middle = pose[2] + turned / 2
    after = pose.copy()
    after += (chord * math.cos(middle), chord * math.sin(middle), turned)
    return after


def _sinc(x: float) -> float:
    return math.sin(x) / x if abs(x) > 1e-8 else 1.0
