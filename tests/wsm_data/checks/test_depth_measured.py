import numpy as np

from wsm_data.checks.depth_measured import check_depth_measured
from wsm_data.errors import Reason


def test_a_frame_without_any_measurement_is_refused_and_named():
    valid = np.ones((6, 4, 5), bool)
    valid[3] = valid[5] = False
    verdict = check_depth_measured(valid, "a")
    assert verdict.reason is Reason.DEPTH_NO_MEASUREMENT
    assert verdict.measured == {"min_measured_share": 0.0, "mean_measured_share": 4 / 6, "frame": 3, "frames": 2}
    assert verdict.message.startswith("a: ")


def test_a_single_measured_pixel_is_enough():
    valid = np.zeros((2, 4, 5), bool)
    valid[:, 1, 1] = True
    verdict = check_depth_measured(valid, "a")
    assert verdict.keep
    assert verdict.measured["min_measured_share"] == 1 / 20
