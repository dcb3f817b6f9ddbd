"""The tracking controller of the start-goal benchmark: model predictive control of a unicycle along a path."""

import numpy as np

from wsm_data.schema.arrays import Float64Array, require_array, require_finite
from wsm_data.sim.tracking.interior_point import minimise
from wsm_data.sim.tracking.reference_path import reference_points
from wsm_data.sim.tracking.tracking_cost import STEPS, UNKNOWNS

_EXECUTED = 1
"""The benchmark executes the second control of its plan, not the first."""

_TRACKED = 5


class TrackingController:
    """Follows one path; a new path takes a new controller, whose search starts from zero again.

    Args:
        path_xy_m: float64 [n, 2], n >= 2, in the frame in which poses are given, m.
        max_speed: bound of the speed, m/s, and of the turning rate, rad/s.

    Raises:
        ValueError: the path is no finite [n, 2] with n >= 2.
    """

    def __init__(self, path_xy_m: Float64Array, max_speed: float):
        require_array("path_xy_m", path_xy_m, np.float64, (None, 2))
        require_finite("path_xy_m", path_xy_m)
        if len(path_xy_m) < 2:
            raise ValueError(f"a path has at least 2 points, found {len(path_xy_m)}")
        self._path_xy_m = path_xy_m
        self._max_speed = max_speed
        self._controls = np.zeros(UNKNOWNS)

    def command(self, pose: Float64Array) -> tuple[float, float]:
        """Speed (m/s) and turning rate (rad/s) for the next control step, at a pose x, y (m), heading (rad)."""
        references = reference_points(self._path_xy_m, pose[:2])[:_TRACKED]
        self._controls = minimise(self._controls, np.asarray(pose, np.float64), references, self._max_speed)
        return float(self._controls[_EXECUTED]), float(self._controls[STEPS + _EXECUTED])
