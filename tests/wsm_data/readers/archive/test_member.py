import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.member import Member


def test_a_member_that_was_refused_gives_its_refusal_for_content():
    refusal = DataError(Reason.FILE_UNREADABLE, "gone")
    with pytest.raises(DataError) as caught:
        Member("a", 0, memoryview(b""), refusal).content()
    assert caught.value is refusal
    assert bytes(Member("a", 1, memoryview(b"x")).content()) == b"x"
