"""From a way to a path that the tracking controller of the benchmark can follow.

That controller never turns towards a straight path behind it, drives no sharp corner, and an episode ends when the
robot has not moved 0.1 m in 4.5 s. So a way that leads off to the side is answered with the turn command, a point at
the left or the right repeated; a path is cut where it bends; and a long turn is broken by a short way straight ahead.
"""

import math

import numpy as np

from wsm_data.schema.arrays import Float64Array

_POINTS = 24
_SPACING_M = 0.1
_LOOK_M = 0.2
_BEGIN_TURN_RAD, _END_TURN_RAD = math.radians(28), math.radians(10)
_BEND_RAD = math.radians(40)
_TURN_PER_STEP_RAD = 0.075
_PATIENCE_STEPS, _EARLIEST_STEPS, _LATEST_STEPS = 23, 14, 20
_NUDGE_STEPS = 2
_NUDGE_ROOM_M, _NUDGE_MOST_M, _OVERSHOOT_M = 0.12, 0.6, 0.04
"""In its two steps the robot drives 0.15 m at most, and where the point is near, 0.04 m less than up to it."""

_TIGHT_M = 0.5
"""With less room ahead than this the robot turns to its way to the end before it drives."""

_STANDING_M = 0.05


class Steering:
    """Answers for one environment; it remembers which way and for how long the robot has been turning."""

    def __init__(self) -> None:
        self._side = 0.0
        self._turning_since = -1
        self._nudging_since = -_NUDGE_STEPS
        self._nudge_m = 0.0

    def path(self, way_xy_m: Float64Array, step: int, free_ahead_m: float) -> Float64Array:
        """The path to answer with.

        Args:
            way_xy_m: the way to go in the base frame, from the robot on; float64 [N, 2], N >= 1, m.
            step: the observation's control step.
            free_ahead_m: how far the robot could drive straight ahead, m.

        Returns:
            float64 [24, 2], m.
        """
        way = _along(np.concatenate([np.zeros((1, 2)), way_xy_m]))
        if np.linalg.norm(way[-1]) < _STANDING_M and len(way) < 3:
            self._stop_turning()
            return np.zeros((_POINTS, 2))
        if step < self._nudging_since + _NUDGE_STEPS:
            return _to(self._nudge_m)
        look = way[min(len(way) - 1, round(_LOOK_M / _SPACING_M))]
        bearing = math.atan2(look[1], look[0])
        loose = self._turning_since < 0 and free_ahead_m > _TIGHT_M
        if abs(bearing) < (_BEGIN_TURN_RAD if loose else _END_TURN_RAD):
            self._stop_turning()
            return _filled(_until_bend(way, bearing))
        return self._turn(bearing, step, free_ahead_m)

    def _turn(self, bearing: float, step: int, free_ahead_m: float) -> Float64Array:
        if self._turning_since < 0:
            self._turning_since = step
        if self._side == 0.0 or abs(bearing) < math.pi / 2:
            self._side = math.copysign(1.0, bearing)
        turned, rest = step - self._turning_since, abs(bearing) / _TURN_PER_STEP_RAD
        due = turned >= _EARLIEST_STEPS and (rest < _PATIENCE_STEPS - 2 or turned >= _LATEST_STEPS)
        if due and turned + rest > _PATIENCE_STEPS and free_ahead_m > _NUDGE_ROOM_M:
            self._nudge_m = min(_NUDGE_MOST_M, free_ahead_m + _OVERSHOOT_M)
            self._turning_since, self._nudging_since = step + _NUDGE_STEPS, step
            return _to(self._nudge_m)
        return np.tile(np.array([0.0, self._side]), (_POINTS, 1))

    def _stop_turning(self) -> None:
        self._side, self._turning_since = 0.0, -1


def _to(ahead_m: float) -> Float64Array:
    """A point straight ahead, repeated: the controller drives to it and stops."""
    return np.tile(np.array([max(ahead_m, 0.0), 0.0]), (_POINTS, 1))


def _along(way: Float64Array) -> Float64Array:
    """Points every 0.1 m along a way, as many as a path has, without its start; its end where it is shorter."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    wanted = np.minimum(_SPACING_M * np.arange(1, _POINTS + 1), length[-1])
    count = max(1, math.ceil(min(1.0, length[-1] / (_SPACING_M * _POINTS)) * _POINTS))
    return np.column_stack([np.interp(wanted[:count], length, way[:, axis]) for axis in range(2)])


def _until_bend(way: Float64Array, bearing: float) -> Float64Array:
    """The first part of a way, as long as it leads roughly in one direction."""
    steps = np.diff(way, axis=0)
    off = np.abs((np.arctan2(steps[:, 1], steps[:, 0]) - bearing + np.pi) % (2 * np.pi) - np.pi)
    bends = np.flatnonzero((off > _BEND_RAD) & (np.linalg.norm(steps, axis=1) > 1e-6))
    return way[: max(int(bends[0]) + 1, round(_LOOK_M / _SPACING_M))] if len(bends) else way


def _filled(way: Float64Array) -> Float64Array:
    """A path of 24 points, evenly along the way, since the controller resamples by index."""
    index = np.linspace(0.0, len(way) - 1.0, _POINTS)
    return np.column_stack([np.interp(index, np.arange(len(way)), way[:, axis]) for axis in range(2)])
