import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.readers.ply_header import parse_ply_header

VALID = (
    b"ply\nformat binary_little_endian 1.0\ncomment by hand\nobj_info none\nelement vertex 2\nproperty float x\n"
    b"property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
)


def test_a_header_is_read_into_elements_and_the_start_of_the_body():
    header = parse_ply_header(memoryview(VALID + bytes(11)))
    vertex, face = header.elements
    assert (vertex.name, vertex.count, vertex.properties) == ("vertex", 2, (("x", "f4"), ("red", "u1")))
    assert (face.name, face.has_lists, vertex.has_lists) == ("face", True, False)
    assert header.body_start == len(VALID)
    assert header.smallest_body_bytes() == 2 * 5 + 1  # two vertices of 5 bytes, one empty list


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"format binary_little_endian 1.0\n", b""),
        (b"binary_little_endian", b"binary_middle_endian"),
        (b"element vertex 2", b"element vertex -2"),
        (b"element vertex 2", b"element vertex two"),
        (b"property float x", b"property quad x"),
        (b"element vertex 2\n", b""),  # a property of nothing
        (b"end_header", b"end_of_header"),
        (b"list uchar int", b"list uchar blob"),
    ],
)
def test_a_malformed_header_is_refused(old, new):
    with pytest.raises(DataError) as caught:
        parse_ply_header(memoryview(VALID.replace(old, new, 1) + bytes(11)))
    assert caught.value.reason is Reason.CLOUD_HEADER


@given(st.integers(4, len(VALID) - 1))
def test_a_header_cut_anywhere_is_refused(length):
    with pytest.raises(DataError) as caught:
        parse_ply_header(memoryview(VALID[:length]))
    assert caught.value.reason is Reason.CLOUD_HEADER


@given(st.binary(max_size=200))
def test_other_bytes_are_refused_and_nothing_else_happens(data):
    with pytest.raises(DataError):
        parse_ply_header(memoryview(b"ply\n" + data.replace(b"end_header", b"")))
