import numpy as np
import pytest

from wsm_data.metrics.depth import depth_errors


def test_errors_are_those_of_the_definitions():
    true = np.array([1.0, 2.0, 4.0, 4.0])
    estimated = np.array([1.2, 2.0, 2.0, 6.0])  # ratios 1.2, 1, 2, 1.5: two of four below 1.25
    found = depth_errors(estimated, true, np.ones(4, bool))
    assert found.abs_rel == pytest.approx((0.2 + 0 + 0.5 + 0.5) / 4)
    assert found.delta1 == 0.5
    assert found.log_rmse == pytest.approx(np.sqrt((np.log(1.2) ** 2 + np.log(2) ** 2 + np.log(1.5) ** 2) / 4))


def test_pixels_that_do_not_count_may_hold_anything():
    found = depth_errors(np.array([2.0, 0.0]), np.array([2.0, 0.0]), np.array([True, False]))
    assert (found.abs_rel, found.delta1, found.log_rmse) == (0.0, 1.0, 0.0)


def test_a_depth_that_is_short_by_a_factor_of_more_than_five_quarters_is_outside_as_one_that_is_long():
    short, long = (depth_errors(np.array([factor]), np.ones(1), np.ones(1, bool)) for factor in (1 / 1.26, 1.26))
    assert short.delta1 == long.delta1 == 0.0


@pytest.mark.parametrize(
    ("estimated", "counts", "says"),
    [
        (np.ones(3), np.ones(2, bool), "one shape and a pixel that counts"),
        (np.ones(2), np.zeros(2, bool), "with 0 pixels"),
        (np.array([1.0, 0.0]), np.ones(2, bool), "above 0 m"),
    ],
)
def test_what_cannot_be_compared_is_refused(estimated, counts, says):
    with pytest.raises(ValueError, match=says):
        depth_errors(estimated, np.ones(2), counts)
