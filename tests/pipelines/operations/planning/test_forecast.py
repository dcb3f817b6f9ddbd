"""Totals of a sample against totals that are known, and the time of work against every way to deal it."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.artifacts.plan_file import Estimate
from pipelines.operations.planning.forecast import scaled, shifted, sum_of, total_of, wall_share


def test_what_is_in_proportion_to_size_is_known_from_two_containers():
    found = total_of([3.0, 6.0], [1.0, 2.0], containers=50, total_size=80.0)
    assert (found.low, found.value, found.high) == pytest.approx((240.0, 240.0, 240.0))


def test_nothing_is_left_to_chance_once_all_were_measured():
    assert total_of([3.0, 7.0], [1.0, 2.0], containers=2, total_size=3.0) == Estimate(value=10.0, low=10.0, high=10.0)
    assert total_of([4.0], [1.0], containers=1, total_size=1.0) == Estimate(value=4.0, low=4.0, high=4.0)


def test_one_of_several_says_nothing_of_how_they_differ():
    with pytest.raises(ValueError, match="at least two of 9 containers"):
        total_of([3.0], [1.0], containers=9, total_size=9.0)


def test_the_interval_is_that_of_the_book_on_a_sample_by_hand():
    # N = 10, n = 3, equal sizes of 1: the mean is 4, the variance 4, so the error of the total is
    # 10 * sqrt(0.7 * 4 / 3) = 9.661, and Student's t for 90 % with 2 degrees of freedom is 2.920.
    found = total_of([2.0, 4.0, 6.0], [1.0, 1.0, 1.0], containers=10, total_size=10.0)
    assert found.value == pytest.approx(40.0)
    assert found.high - found.value == pytest.approx(2.920 * 9.661, rel=1e-3)
    assert found.low == 12.0  # 40 - 28.2 is less than what was measured


def test_intervals_hold_about_nine_of_ten_totals():
    """Containers whose content is in proportion to their size but for 20 %: 400 samples of 6 out of 60."""
    rng = np.random.default_rng(3)
    sizes = rng.lognormal(0.0, 0.4, 60)
    values = sizes * rng.normal(5.0, 1.0, 60)
    held, errors = 0, []
    for _ in range(400):
        chosen = rng.permutation(60)[:6]
        found = total_of(values[chosen], sizes[chosen], 60, sizes.sum())
        held += found.low <= values.sum() <= found.high
        errors.append(found.value / values.sum() - 1)
    assert 0.84 <= held / 400 <= 0.95  # of 0.9, with a standard error of 0.015 and a slight bias of small samples
    assert abs(np.mean(errors)) < 0.02


@given(st.lists(st.floats(0.01, 9.0), min_size=1, max_size=6), st.integers(1, 3))
def test_the_longest_first_takes_at_most_a_third_more_than_the_best_way_to_deal(seconds, workers):
    """Graham's bound: 4/3 - 1/(3 m) times the best; never less than the best itself."""
    deals = product(range(workers), repeat=len(seconds))
    best = min(
        max(sum(s for s, w in zip(seconds, deal, strict=True) if w == one) for one in range(workers)) for deal in deals
    )
    found = wall_share(seconds, workers) * sum(seconds)
    assert best * (1 - 1e-9) <= found <= best * (4 / 3 - 1 / (3 * workers)) * (1 + 1e-9)


def test_work_that_takes_no_time_is_dealt_evenly():
    assert wall_share([0.0, 0.0], 4) == 0.25


def test_estimates_are_scaled_shifted_and_added_bound_by_bound():
    one = Estimate(value=2.0, low=1.0, high=4.0)
    assert scaled(one, 2.0) == Estimate(value=4.0, low=2.0, high=8.0)
    assert shifted(one, 1.0) == Estimate(value=3.0, low=2.0, high=5.0)
    assert sum_of([one, shifted(one, 1.0)]) == Estimate(value=5.0, low=3.0, high=9.0)
