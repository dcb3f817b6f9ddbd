"""The depth contract refuses what cannot be a depth image or a depth range."""

import pytest

from wsm_data.schema.depth import DepthEncoding, DepthRange


def test_tenths_of_a_millimetre_are_accepted():
    encoding = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
    assert encoding.bits == 16


@pytest.mark.parametrize("scale", [0.0, -1e-4, 1.0, 10_000.0, float("nan")])
def test_a_scale_that_is_no_length_of_a_step_is_refused(scale):
    # 10000 is the usual mistake: units per metre where metres per unit are asked for
    with pytest.raises(ValueError, match="metres_per_unit must lie in"):
        DepthEncoding(metres_per_unit=scale, invalid_codes=(0,))


def test_eight_bit_depth_is_refused():
    with pytest.raises(ValueError, match="only 16-bit depth images are supported, found bits = 8"):
        DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0,), bits=8)


def test_the_default_range_is_the_papers():
    assert (DepthRange().min_m, DepthRange().max_m) == (0.2, 5.0)


@pytest.mark.parametrize(("near", "far"), [(0.0, 5.0), (-1.0, 5.0), (5.0, 0.2), (1.0, 1.0), (0.2, float("nan"))])
def test_a_range_without_an_inside_is_refused(near, far):
    with pytest.raises(ValueError, match="needs 0 < min_m < max_m"):
        DepthRange(min_m=near, max_m=far)
