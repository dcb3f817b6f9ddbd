import numpy as np

from wsm_data.checks.depth_measured import check_depth_measured
from wsm_data.errors import Reason


def test_a_frame_without_any_measurement_is_refused_and_named():
    depth_m = np.ones((6, 4, 5), np.float32)
    depth_m[3] = 0
    verdict = check_depth_measured(depth_m, "a")
    assert (verdict.reason, verdict.measured["frame"]) == (Reason.DEPTH_NO_MEASUREMENT, 3)


def test_a_single_measured_pixel_is_enough():
    depth_m = np.zeros((2, 4, 5), np.float32)
    depth_m[:, 1, 1] = 2.5
    verdict = check_depth_measured(depth_m, "a")
    assert verdict.keep
    assert verdict.measured["min_measured_share"] == 1 / 20
