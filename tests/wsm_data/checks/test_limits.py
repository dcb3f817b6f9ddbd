import pytest

from wsm_data.checks.limits import verdict_within
from wsm_data.errors import Reason


def verdict(**limits):
    return verdict_within(limits, Reason.MOUNT_MISFIT, "a/b/c: it does not fit")


@pytest.mark.parametrize("value", [0.5, 0.75, 1.0])
def test_numbers_within_their_limits_are_kept_and_reported(value):
    assert verdict(height_m=(value, 0.5, 1.0)).keep
    assert verdict(height_m=(value, 0.5, 1.0)).measured == {"height_m": value}


@pytest.mark.parametrize("value", [0.499, 1.001, float("nan"), float("inf")])
def test_a_number_outside_its_limits_is_refused(value):
    assert verdict(height_m=(value, 0.5, 1.0)).reason is Reason.MOUNT_MISFIT


def test_the_message_names_every_broken_limit_and_all_numbers_are_reported():
    refused = verdict(height_m=(2.5, 0.05, 2.0), pitch_deg=(1.0, 0.0, 2.0), roll_deg=(7.25, 0.0, 5.0))
    assert refused.message == (
        "a/b/c: it does not fit: height_m must lie in [0.05, 2], found 2.5; roll_deg must lie in [0, 5], found 7.25"
    )
    assert refused.measured == {"height_m": 2.5, "pitch_deg": 1.0, "roll_deg": 7.25}
