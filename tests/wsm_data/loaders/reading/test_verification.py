import pytest

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.config import ReadConfig, SourceConfig, Verify
from wsm_data.loaders.reading.verification import Verification, verification_of
from wsm_data.loaders.sources.clips import open_sources


@pytest.mark.parametrize(("verify", "due"), [(Verify.ALWAYS, True), (Verify.NEVER, False)])
def test_always_and_never_do_not_depend_on_what_was_checked(verify, due):
    verification = Verification([verify], [20])
    assert verification.is_due(0, 3) is due
    verification.passed(0, 3)
    assert verification.is_due(0, 3) is due


def test_first_checks_each_clip_of_each_source_until_it_passed():
    verification = Verification([Verify.FIRST, Verify.FIRST], [17, 9])
    passed = {(0, 0), (0, 7), (0, 8), (0, 16), (1, 8)}
    for source, number in passed:
        verification.passed(source, number)
    due = {(0, number) for number in range(17) if verification.is_due(0, number)}
    due |= {(1, number) for number in range(9) if verification.is_due(1, number)}
    everything = {(0, number) for number in range(17)} | {(1, number) for number in range(9)}
    assert due == everything - passed


def test_one_bit_is_kept_for_a_clip():
    assert sum(len(bits) for bits in Verification([Verify.FIRST], [1_000_001])._checked) == 125_001


def test_sources_have_policies_of_their_own():
    verification = Verification([Verify.ALWAYS, Verify.FIRST], [3, 3])
    for source in (0, 1):
        verification.passed(source, 2)
    assert [verification.is_due(source, 2) for source in (0, 1)] == [True, False]


@pytest.mark.parametrize("verify", list(Verify))
@pytest.mark.parametrize("access", list(RemoteAccess))
def test_first_is_always_where_each_reading_is_a_new_transfer(remote, verify, access):
    sources = open_sources([SourceConfig(release=str(remote.published.folder)), SourceConfig(release=remote.url)])
    verification = verification_of(sources.tables, ReadConfig(verify=verify, access=access))
    for source in (0, 1):
        verification.passed(source, 5)
    far = verify is Verify.ALWAYS or (verify is Verify.FIRST and access is RemoteAccess.RANGES)
    assert [verification.is_due(source, 5) for source in (0, 1)] == [verify is Verify.ALWAYS, far]
