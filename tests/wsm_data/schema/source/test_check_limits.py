from dataclasses import fields

import pytest

from wsm_data.schema.source.check_limits import CheckLimits


@pytest.mark.parametrize("name", [field.name for field in fields(CheckLimits)])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_a_limit_is_a_finite_number_that_is_not_negative(name, value):
    with pytest.raises(ValueError, match=f"{name} must be finite and not negative"):
        CheckLimits(**{name: value})


def test_depth_that_is_rounded_cannot_agree_exactly():
    with pytest.raises(ValueError, match="max_depth_error must be above 0"):
        CheckLimits(max_depth_error=0.0)


def test_the_default_clearance_lies_below_what_a_sound_path_keeps_on_a_map():
    """0.21 m is the smallest measured; path and obstacle are off by half the diagonal of a 0.05 m cell each."""
    assert CheckLimits().min_path_clearance_m < 0.21 - 2 * 0.5 * 0.05 * 2**0.5
