import sys
from pathlib import Path

import numpy as np
import pytest

from wsm_data.readers.lerobot.depth_codes import CODES, DepthQuantisation, quantisation_of, raw_depth_table

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

UNIT_M = 2e-4


def lerobots_own(**changes):
    return DepthQuantisation(**{"depth_min": 0.01, "depth_max": 10.0, "shift": 3.5, "use_log": True, **changes})


def test_depth_comes_back_within_half_a_step_of_its_quantisation():
    pytest.importorskip("av")
    from lerobot_set import quantised

    depth_m = np.linspace(0.02, 9.98, 5000)
    back_m = raw_depth_table(lerobots_own(), UNIT_M)[quantised(depth_m)] * UNIT_M
    step_m = (depth_m + 3.5) * np.log(13.5 / 3.51) / 4095  # derivative of the inverse
    assert (np.abs(back_m - depth_m) <= step_m / 2 + UNIT_M / 2 + 1e-6).all()


def test_codes_without_logarithm_are_even_in_depth():
    table = raw_depth_table(lerobots_own(use_log=False, depth_min=0.0), UNIT_M)
    assert table[2048] == round(10.0 * 2048 / 4095 / UNIT_M)


def test_clipped_codes_and_what_does_not_fit_into_16_bits_are_no_measurement():
    table = raw_depth_table(lerobots_own(), 1e-4)
    assert len(table) == CODES
    assert (table[0], table[-1]) == (0, 0)
    assert table.max() <= 65535
    assert table[4000] == 0  # 9.6 m, and 16 bits of 0.1 mm end at 6.55 m


@pytest.mark.parametrize(
    ("info", "said"),
    [
        ({}, "is_depth_map"),
        ({"video.is_depth_map": False}, "is_depth_map"),
        ({"is_depth_map": True, "video.depth_min": 0.1}, r"lacks video\.depth_max"),
    ],
)
def test_a_video_that_does_not_say_how_it_was_quantised_is_refused(info, said):
    with pytest.raises(ValueError, match=said):
        quantisation_of({"info": info})


@pytest.mark.parametrize("changes", [{"depth_max": 0.0}, {"shift": -1.0}, {"depth_min": float("nan")}])
def test_a_quantisation_that_cannot_be_is_refused(changes):
    with pytest.raises(ValueError, match="needs 0 <= depth_min < depth_max"):
        lerobots_own(**changes)
