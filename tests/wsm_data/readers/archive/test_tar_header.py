import tarfile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.tar_header import parse_header, parse_pax


@given(size=st.integers(0, 8**11 - 1), name=st.text("abc/._-09", min_size=1, max_size=100))
def test_a_header_says_what_tarfile_put_into_it(size, name):
    info = tarfile.TarInfo(name)
    info.size = size
    header = parse_header(memoryview(info.tobuf(tarfile.USTAR_FORMAT)), "a")
    assert (header.name, header.size, header.kind) == (name, size, b"0")


def test_any_changed_byte_of_a_header_is_noticed():
    block = tarfile.TarInfo("scene/file").tobuf(tarfile.USTAR_FORMAT)
    for position in (*range(148), *range(156, 512)):  # the rest is the checksum and its padding
        changed = bytearray(block)
        changed[position] ^= 0x10
        with pytest.raises(DataError) as caught:
            parse_header(memoryview(changed), "a")
        assert caught.value.reason is Reason.ARCHIVE_CORRUPT


def test_pax_records_are_read_by_their_length_and_may_hold_newlines():
    assert parse_pax(b"12 path=a/b\n17 comment=a\nb c\n", "a") == {"path": "a/b", "comment": "a\nb c"}


@pytest.mark.parametrize("content", [b"99 path=a\n", b"path=a\n", b"7 path\n", b"0 path=a\n", b"8 path=a"])
def test_a_malformed_pax_record_is_corrupt(content):
    with pytest.raises(DataError) as caught:
        parse_pax(content, "a")
    assert caught.value.reason is Reason.ARCHIVE_CORRUPT
