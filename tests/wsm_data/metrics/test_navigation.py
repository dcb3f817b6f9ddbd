import pytest

from wsm_data.metrics.navigation import weighted_success


@pytest.mark.parametrize(
    ("success", "driven_m", "wanted"),
    [(True, 8.0, 0.5), (True, 4.0, 1.0), (True, 3.0, 1.0), (True, 0.0, 1.0), (False, 4.0, 0.0)],
)
def test_the_share_of_the_shortest_way_in_what_was_driven_is_capped_at_one(success, driven_m, wanted):
    assert weighted_success(success, 4.0, driven_m) == wanted


@pytest.mark.parametrize(
    ("shortest_m", "driven_m"), [(0.0, 1.0), (float("inf"), 1.0), (1.0, -1.0), (1.0, float("nan"))]
)
def test_a_length_that_is_none_is_refused(shortest_m, driven_m):
    with pytest.raises(ValueError, match="lengths must be finite"):
        weighted_success(True, shortest_m, driven_m)
