import pytest

from wsm_data.loaders.config import Verify
from wsm_data.loaders.verification import Verification


@pytest.mark.parametrize(("verify", "due"), [(Verify.ALWAYS, True), (Verify.NEVER, False)])
def test_always_and_never_do_not_depend_on_what_was_checked(verify, due):
    verification = Verification(verify, [20])
    assert verification.is_due(0, 3) is due
    verification.passed(0, 3)
    assert verification.is_due(0, 3) is due


def test_first_checks_each_clip_of_each_source_until_it_passed():
    verification = Verification(Verify.FIRST, [17, 9])
    passed = {(0, 0), (0, 7), (0, 8), (0, 16), (1, 8)}
    for source, number in passed:
        verification.passed(source, number)
    due = {(0, number) for number in range(17) if verification.is_due(0, number)}
    due |= {(1, number) for number in range(9) if verification.is_due(1, number)}
    everything = {(0, number) for number in range(17)} | {(1, number) for number in range(9)}
    assert due == everything - passed


def test_one_bit_is_kept_for_a_clip():
    assert sum(bits.nbytes for bits in Verification(Verify.FIRST, [1_000_001])._checked) == 125_001
